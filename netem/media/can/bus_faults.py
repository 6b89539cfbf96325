"""Faults of a CAN bus and its controllers: a controller that goes bus-off or babbles, a bus that is stuck dominant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from netem.core.agenda import OFFER, Agenda
from netem.media.can.bus_state import BusState
from netem.media.can.controller import Controller
from netem.media.can.error_frame import FLAG_BITS
from netem.media.can.error_handling import ErrorHandling
from netem.media.can.frame import CanFrame, pack
from netem.media.can.stuck_dominant import Window

FAULT: Final = -1                       # priority in the agenda: before all else at an instant
AFTER_ARBITRATION: Final = OFFER + 2


class BusFaults:
    """`offer(node, data, now_ns)` makes an offer of the node."""

    def __init__(self, state: BusState, errors: ErrorHandling, agenda: Agenda,
                 offer: Callable[[str, bytes, int], None]) -> None:
        self._state, self._errors, self._agenda, self._offer = state, errors, agenda, offer

    def take(self, how: str, of: Sequence[str], fields: Mapping[str, Any], start_ns: int, end_ns: int) -> str:
        """Carry out a fault, as `Medium.take_fault` says."""
        if how == "held dominant":
            window = Window(start_ns, end_ns)
            self._errors.expect_stuck(window)
            self._agenda.at(start_ns, FAULT, self._state.name, partial(self._errors.stuck, window))
            return ""
        controller = self._state.controllers[of[0]]
        if how == "off":
            return self._errors.force_bus_off(controller, start_ns)
        self._babble(controller, pack(CanFrame(fields["can_id"], b"\x55" * fields["length"], fields["extended"])),
                     end_ns, -1, start_ns)
        return ""

    def signal_error(self, now_ns: int) -> None:
        """Put an error flag on the bus as soon as it is free: a node outside the run has found an error.

        The fate of a frame on the bus was decided at its start, so the flag follows it.
        """
        start_ns = max(now_ns, self._state.timeline.free_ns)
        self._agenda.at(start_ns, FAULT, self._state.name, partial(self._flag, start_ns))

    def _flag(self, start_ns: int) -> None:
        free_ns = self._state.timeline.free_ns
        if free_ns > start_ns:                  # another flag came first
            self._agenda.at(free_ns, FAULT, self._state.name, partial(self._flag, free_ns))
            return
        clock = self._state.timeline.clock
        self._errors.stuck(Window(start_ns, start_ns + clock.ns(FLAG_BITS * clock.nominal)))
        for tap in self._state.taps:
            tap.error_frame(self._state.name, start_ns)

    def _babble(self, controller: Controller, data: bytes, end_ns: int, number: int, now_ns: int) -> None:
        """Keep one frame of the babbling controller waiting until `end_ns`; `number` is that of the last one."""
        if now_ns >= end_ns:
            return
        waits = any(frame.number == number for _, _, frame, _ in controller.queue.waiting)
        if not waits and controller.recovery is None:
            number = controller.number
            self._offer(controller.name, data, now_ns)
        self._agenda.at(now_ns, AFTER_ARBITRATION, controller.name,
                        partial(self._await_bus, controller, data, end_ns, number))

    def _await_bus(self, controller: Controller, data: bytes, end_ns: int, number: int) -> None:
        """Look again when the bus is free, or the controller may send."""
        now_ns = self._agenda.now_ns
        next_ns = max(self._state.timeline.free_ns, controller.ready_ns)
        if controller.recovery is not None:
            next_ns = max(next_ns, controller.recovery.due_ns())
        next_ns = max(next_ns, now_ns + 1)
        if next_ns < end_ns:
            self._agenda.at(next_ns, OFFER, controller.name,
                            partial(self._babble, controller, data, end_ns, number, next_ns))

