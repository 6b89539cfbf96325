"""The input of monitors: all records of a run up to `length_ns`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from agents.hybrid.automaton import Automaton
from experiments.judge.frame_copies import FrameCopies
from netem.media import MediumSettings
from netem.media.answers import Camera
from netem.records.events import Event
from netem.records.signal_table import SignalTable


@dataclass(frozen=True)
class Records:
    """`signals` are by node, derived ones included; `sights` are the settings of the media that observe bodies.

    `automata` are those that programs declare, by node; on the media `showing` a copy is a sight of its sender.
    """

    length_ns: int
    ledger: FrameCopies
    signals: Mapping[str, SignalTable] = field(default_factory=dict)
    events: Sequence[Event] = ()
    sights: Mapping[str, MediumSettings] = field(default_factory=dict)
    automata: Mapping[str, Automaton] = field(default_factory=dict)
    showing: frozenset[str] = frozenset()

    def camera(self, medium: str, observer: str) -> Camera:
        """Return the field of view of an observer on one of the `sights`."""
        camera = self.sights[medium].camera(observer)
        assert camera is not None, f"{medium} shows bodies, and {observer} sees none"
        return camera
