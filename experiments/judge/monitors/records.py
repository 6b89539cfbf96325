"""The input of monitors: all records of a run up to `length_ns`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from experiments.judge.frame_copies import FrameCopies
from netem.media.sensing.settings import SensingSettings
from netem.records.events import Event
from netem.records.signal_table import SignalTable


@dataclass(frozen=True)
class Records:
    """`signals` by node, those worked out after the run included; `sensing`: the settings of the media of that kind."""

    length_ns: int
    ledger: FrameCopies
    signals: Mapping[str, SignalTable] = field(default_factory=dict)
    events: Sequence[Event] = ()
    sensing: Mapping[str, SensingSettings] = field(default_factory=dict)
