"""Calls of FMI 3.0's event mode and clocks, for one instance whose host handles its events.

    initialization --> event mode <--> step mode        clocks tick and clocked variables have values in event mode only

Source: FMI 3.0.2, sections 2.2.8 (clocks) and 4.2 (co-simulation with event mode).
"""

from __future__ import annotations

import ctypes as c
from collections.abc import Sequence
from fractions import Fraction
from math import isfinite
from typing import Final, NamedTuple

from fmus.call_record import CallRecord
from fmus.description import PlantDescription, Variable
from fmus.errors import PlantError
from fmus.fmi_calls import Call, Fmu3

NOT_YET_KNOWN: Final = 0        # fmi3IntervalQualifier
UNCHANGED: Final = 1
CHANGED: Final = 2


class Updated(NamedTuple):
    """The answer of fmi3UpdateDiscreteStates."""

    again: bool                 # another event iteration is needed
    ends: bool                  # the model ends the simulation
    next_event_s: float | None  # instant at which the FMU wants event mode next [s]


class Told(NamedTuple):
    """What an FMU says about the interval of a clock."""

    qualifier: int
    interval_s: Fraction


class EventFmu(Fmu3):
    in_event_mode = True

    def __init__(self, description: PlantDescription, instance_name: str, logging: bool,
                 record: CallRecord | None = None) -> None:
        self._calls: dict[str, Call] = {}
        super().__init__(description, instance_name, logging, record)

    def enter_event_mode(self) -> int:
        return self._call("EnterEventMode")(self.handle)

    def enter_step_mode(self) -> int:
        return self._call("EnterStepMode")(self.handle)

    def update(self) -> tuple[int, Updated]:
        """Finish an event iteration; returns the FMI status and what is left to do."""
        flags, next_s = (c.c_bool * 5)(), c.c_double(0)
        places = [c.byref(flags, place) for place in range(5)]
        status = self._call("UpdateDiscreteStates")(self.handle, *places, c.byref(next_s))
        return status, Updated(flags[0], flags[1], next_s.value if flags[4] else None)

    def tick(self, references: Sequence[int]) -> int:
        """Activate input clocks."""
        count = len(references)
        return self._call("SetClock")(self.handle, c.byref((c.c_uint * count)(*references)),
                                      c.c_size_t.from_param(count), c.byref((c.c_bool * count)(*[True] * count)))

    def ticking(self, references: Sequence[int]) -> tuple[int, list[int]]:
        """Return the FMI status and those of the output clocks that tick, each once."""
        count = len(references)
        active = (c.c_bool * count)()
        status = self._call("GetClock")(self.handle, c.byref((c.c_uint * count)(*references)),
                                        c.c_size_t.from_param(count), c.byref(active))
        return status, [reference for reference, on in zip(references, active, strict=True) if on]

    def interval(self, clock: Variable) -> tuple[int, Told]:
        """Return the FMI status and the interval of a clock; raises PlantError if it is no time."""
        one = (c.c_uint * 1)(clock.reference)
        size, qualifier = c.c_size_t.from_param(1), c.c_int(NOT_YET_KNOWN)
        if clock.clock is not None and clock.clock.fraction:
            counter, resolution = c.c_uint64(0), c.c_uint64(1)
            status = self._call("GetIntervalFraction")(self.handle, c.byref(one), size, c.byref(counter),
                                                       c.byref(resolution), c.byref(qualifier))
            return status, Told(qualifier.value, Fraction(counter.value, resolution.value or 1))
        seconds = c.c_double(0)
        status = self._call("GetIntervalDecimal")(self.handle, c.byref(one), size, c.byref(seconds),
                                                  c.byref(qualifier))
        if not (isfinite(seconds.value) and seconds.value >= 0):
            if qualifier.value != CHANGED or status > 1:
                return status, Told(qualifier.value, Fraction(0))
            raise PlantError(f"{self.description.file}: clock {clock.name}: the FMU gives an interval of "
                             f"{seconds.value} s: expected 0 or more")
        return status, Told(qualifier.value, Fraction(repr(seconds.value)))

    def get_binary(self, variable: Variable) -> tuple[int, bytes]:
        status, values = self.get_elements(variable)
        return status, values[0] if values else b""

    def _call(self, name: str) -> Call:
        found = self._calls.get(name)
        if found is None:
            found = self._calls[name] = self.function(name)
        return found
