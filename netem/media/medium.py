"""The base class of every medium: three methods that a member implements, and queries that have defaults."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

from mypy_extensions import mypyc_attr

from netem.media import MediumSettings
from netem.media.answers import ShownPose
from netem.media.observation import MediumObserver
from netem.records import FrameTap


@mypyc_attr(allow_interpreted_subclasses=True)
class Medium:
    """The medium `name` between `nodes`.

    The emulator builds a member as `Member(name, settings, nodes, agenda, ledger, links, rng_for)`, where `settings` is
    a `Member.Settings` and `nodes` maps each node to its position [m], or to None.
    """

    Settings: ClassVar[type[MediumSettings]] = MediumSettings
    signals: ClassVar[Sequence[tuple[str, str]]] = ()       # (name, unit) of each value that it samples

    def __init__(self, name: str, nodes: Iterable[str]) -> None:
        self.name = name
        self.nodes = tuple(nodes)
        self.taps: list[FrameTap] = []          # recorders of the frames that have been on the air
        self.poses: Mapping[str, ShownPose] = {}        # by node, what it shows to the medium

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        """Take the frame `data` that `sender` offers at `now_ns`.

        Calls are in order of time, never before the last event run.
        """
        raise NotImplementedError

    def show(self, node: str, values: Sequence[float], now_ns: int) -> None:
        """Take the outputs of the plant of `node` that `poses` names, finite numbers, at a multiple of their period.

        Calls precede all other events of the instant, and come before any event of a later instant.
        """
        raise NotImplementedError

    def lookahead_ns(self, t0_ns: int) -> int:
        """Return the earliest instant, at least t0_ns, at which a frame can reach a node.

        The frame is on the air now or is offered at or after t0_ns.
        """
        raise NotImplementedError

    def finish(self, end_ns: int) -> None:
        """Close every copy that is queued or on the air at the end of the run as `Fate.UNFINISHED`."""
        raise NotImplementedError

    def take_fault(self, how: str, cause: str, of: Sequence[str], fields: Mapping[str, Any], start_ns: int,
                   end_ns: int) -> str:
        """Fail on [start_ns, end_ns), in a way that faults of what the settings call `strikable` name.

        `of` has the nodes that it is about: none, one, or sender and receiver of a link. Returns why the fault has no
        effect, "" if it has one. Called at `start_ns` or before.
        """
        raise NotImplementedError(f"{self.name} has no way {how!r} to fail")

    def next_fault_ns(self, now_ns: int) -> int:
        """Return the earliest instant, at least `now_ns`, at which a fault that nobody knew of can begin."""
        return now_ns

    def links(self, until_ns: int) -> Sequence[tuple[str, str]]:
        """Return (sender, receiver) of each directed link that exists at some time in [0, until_ns).

        The default is every pair of nodes.
        """
        return [(sender, receiver) for sender in self.nodes for receiver in self.nodes if sender != receiver]

    def changes_ns(self, until_ns: int) -> Sequence[int]:
        """Return the instants in (0, until_ns) at which the links change."""
        return ()

    def observe(self, observer: MediumObserver) -> None:
        """Pass all later events and samples to `observer`.

        Their instants may lie after the call, even after the end of the run.
        """

    def tables(self) -> Mapping[str, Sequence[tuple[str, str]]]:
        """Return the tables of signals that it samples besides its own, by name: (name, unit) of each signal."""
        return {}

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        """Return counters by node; those that belong to no node are under the name of the medium."""
        return {}
