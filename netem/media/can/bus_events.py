"""The events of a CAN bus: changes of state, error frames, identifiers that clash, malformed frames.

Each event names the bus. Events that may repeat with every frame are recorded once; the counters have the totals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from netem.media.can.controller import Controller
from netem.media.can.error_frame import ErrorFrame
from netem.media.can.fault_confinement import State
from netem.media.can.frame import unpack
from netem.media.observation import MediumObserver
from netem.records.events import Event
from netem.wire.level import Level

TOLD_ERROR_FRAMES: Final = 1_000


class BusEvents:
    def __init__(self, bus: str) -> None:
        self.observer = MediumObserver()
        self._bus = bus
        self._told: set[tuple[str, str, str]] = set()
        self._error_frames = 0

    def state(self, controller: Controller, time_ns: int) -> None:
        state = controller.faults.state
        self._tell(time_ns, controller.name, state.value, _error_counters(controller),
                   Level.INFO if state is State.ERROR_ACTIVE else Level.WARNING)

    def error_frame(self, sender: Controller, data: bytes, error: ErrorFrame, time_ns: int) -> None:
        self._error_frames += 1
        if self._error_frames <= TOLD_ERROR_FRAMES:
            self._tell(time_ns, sender.name, "CAN error frame",
                       f"{identifier_text(data)}: {error.cause.value}, {error.field.value}, bit {error.last_bit}; "
                       + _error_counters(sender), Level.INFO)

    def unacknowledged(self, sender: Controller, data: bytes, time_ns: int) -> None:
        self._tell(time_ns, sender.name, "no acknowledgement", f"{identifier_text(data)}; {_error_counters(sender)}")

    def malformed(self, node: str, cause: str, time_ns: int) -> None:
        self._tell_once(time_ns, node, "malformed CAN frame", cause)

    def not_as_declared(self, node: str, data: bytes, words: str, time_ns: int) -> None:
        self._tell(time_ns, node, "not as declared", f"{identifier_text(data)}: {words}")

    def same_identifier(self, senders: Sequence[Controller], data: bytes, time_ns: int) -> None:
        names = ", ".join(sender.name for sender in senders)
        for sender in senders:
            self._tell_once(time_ns, sender.name, "same identifier",
                            f"{identifier_text(data)} with different bits at once from {names}")

    def same_frame(self, twin: Controller, lead: Controller, data: bytes, time_ns: int) -> None:
        self._tell_once(time_ns, twin.name, "same frame", f"{identifier_text(data)} at once with {lead.name}",
                        Level.INFO)

    def may_be_late(self, line: str) -> None:
        self._tell(0, self._bus, "message may be late", line)

    def _tell(self, time_ns: int, node: str, kind: str, words: str, level: Level = Level.WARNING) -> None:
        self.observer.event(Event(time_ns, node, kind, f"{self._bus}: {words}", level))

    def _tell_once(self, time_ns: int, node: str, kind: str, words: str, level: Level = Level.WARNING) -> None:
        if (node, kind, words) not in self._told:
            self._told.add((node, kind, words))
            self._tell(time_ns, node, kind, words, level)


def identifier_text(data: bytes) -> str:
    frame = unpack(data)
    return f"{frame.can_id:#x}" + " extended" * frame.extended + " remote" * frame.remote


def _error_counters(controller: Controller) -> str:
    return f"TEC {controller.faults.transmit_errors}, REC {controller.faults.receive_errors}"
