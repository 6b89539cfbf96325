"""The base class of every medium: three verbs that a member has, and questions that have defaults."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar

from mypy_extensions import mypyc_attr

from netem.media import MediumSettings
from netem.media.observation import MediumObserver
from netem.records import FrameTap


@mypyc_attr(allow_interpreted_subclasses=True)
class Medium:
    """The medium `name` between `nodes`.

    The emulator builds a member as `Member(name, settings, nodes, agenda, ledger, links, rng_for)`, `settings` being a
    `Member.Settings` and `nodes` a mapping from each node to where it stands [m], or to None.
    """

    Settings: ClassVar[type[MediumSettings]] = MediumSettings
    signals: ClassVar[Sequence[tuple[str, str]]] = ()       # (name, unit) of each value that it samples

    def __init__(self, name: str, nodes: Iterable[str]) -> None:
        self.name = name
        self.nodes = tuple(nodes)
        self.taps: list[FrameTap] = []          # who gets each frame when it has been on the air

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        """`sender` hands out `data` at `now_ns`; called in order, never for a time before the last event run."""
        raise NotImplementedError

    def lookahead_ns(self, t0_ns: int) -> int:
        """Earliest instant (>= t0_ns) at which anything handed out from t0_ns on, or on the air now, reaches a node."""
        raise NotImplementedError

    def finish(self, end_ns: int) -> None:
        """The run ended: close every copy that is still queued or on the air as `Fate.UNFINISHED`."""
        raise NotImplementedError

    def links(self, until_ns: int) -> Sequence[tuple[str, str]]:
        """(sender, receiver) of each directed link that there is at some time in [0, until_ns); default: every pair."""
        return [(sender, receiver) for sender in self.nodes for receiver in self.nodes if sender != receiver]

    def changes_ns(self, until_ns: int) -> Sequence[int]:
        """The instants in (0, until_ns) at which its links change."""
        return ()

    def observe(self, observer: MediumObserver) -> None:
        """Tell `observer` its events and samples from now on. An instant may lie ahead of the call, even beyond the end
        of the run."""

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        """By node, or by the name of the medium for what is no node's."""
        return {}
