"""A microcontroller's clock, which the firmware reads instead of true time.

    local(t) = tick * floor((offset + (1 + drift) t) / tick)          t, offset, tick in ns, drift = ppm * 1e-6

The affine function is kept as two integers over UNIT = 10^12: (phase + rate * t) / UNIT. Only the reading is rounded,
however long the run and however often the clock is adjusted. Rates have a resolution of 1e-6 ppm.

Source: the affine clock of Schenato & Fiorentin, "Average TimeSynch", Automatica 47 (2011), eq. (1), with a tick.
Not modelled: drift that varies with temperature or age, read jitter, wrap-around of a counter; a trim is added to the
drift, not multiplied with it (a difference of drift * trim, 1e-8 for 100 ppm each).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from firmware_sim.clock_settings import ClockSettings

UNIT: Final = 10**12            # rates are integers in parts per UNIT
PARTS_PER_PPM: Final = 10**6


def rate_parts(ppm: float) -> int:
    """Return `ppm` in parts per 10^12, rounded; ValueError unless -1e6 < ppm < 1e6."""
    if not -1e6 < ppm < 1e6:
        raise ValueError(f"{ppm} ppm: expected more than -1e6 and less than 1e6, so that the clock runs forward")
    return round(ppm * PARTS_PER_PPM)


class LocalClock:
    """Converts between local time and the true time that `true_now` returns.

    Invariants:
    - between two changes the reading never decreases, and `true_at` inverts it exactly;
    - `trim` does not change the reading at its instant, to less than 1e-12 ns;
    - after `adjust` with a negative step, local instants occur twice. A program that must act once per slot or period
      remembers the slot's number (`SlottedBroadcast.next_slot_of(..., after_slot=)`), not its time.
    """

    __slots__ = ("_fault_rate", "_ideal", "_phase", "_rate", "_tick_ns", "_true_now", "settings")

    def __init__(self, settings: ClockSettings, true_now: Callable[[], int]) -> None:
        self.settings = settings
        self._true_now = true_now
        # Any: Python handles signals within operations on large integers, and compiled code aborts the process if the
        # handler raises within an operation on `int`.
        self._tick_ns: Any = settings.tick_ns
        self._phase: Any = settings.offset_ns * UNIT
        self._rate: Any = UNIT + rate_parts(settings.drift_ppm)
        self._fault_rate: Any = 0       # part of the rate that is the oscillator's, by faults
        self._note_ideal()

    def now_ns(self) -> int:
        """Return the local time in ns, rounded down to the tick."""
        return self._true_now() if self._ideal else self.reading_at(self._true_now())

    def reading_at(self, true_ns: int) -> int:
        """Return the local time at the true instant `true_ns`, with the clock's present offset and rate."""
        reading = (self._phase + self._rate * true_ns) // UNIT
        rounded: int = reading - reading % self._tick_ns
        return rounded

    def true_at(self, local_ns: int) -> int:
        """Return the earliest true instant at which the clock, with its present offset and rate, reads >= `local_ns`.

        The instant is in the past if the clock reads more already.
        """
        if self._ideal:
            return local_ns
        first_reading = -(-local_ns // self._tick_ns) * self._tick_ns
        true_ns: int = -((self._phase - first_reading * UNIT) // self._rate)
        return true_ns

    def adjust(self, delta_ns: int) -> None:
        """Add `delta_ns` to local time from now on."""
        self._phase += delta_ns * UNIT
        self._note_ideal()

    def trim(self, ppm: float) -> None:
        """Run faster by `ppm` from now on; trims add up. ValueError if the clock would no longer run forward."""
        change = rate_parts(ppm)
        if self._rate + change <= 0:
            raise ValueError(f"trim of {ppm} ppm: the clock would stand still or run backwards "
                             f"(its drift is {self.drift_ppm} ppm)")
        self._rate += change
        self._phase -= change * self._true_now()
        self._note_ideal()

    def drift(self, ppm: float) -> None:
        """Let the oscillator run faster by `ppm` from now on, by a fault; raises as `trim`."""
        self.trim(ppm)
        self._fault_rate += rate_parts(ppm)

    @property
    def fault_ppm(self) -> float:
        """What faults have added to the drift of the oscillator so far [ppm]."""
        return float(self._fault_rate) / PARTS_PER_PPM

    def kept(self) -> tuple[str, str, str]:
        """Return the state of the clock in decimal, for `resume` by the clock of a later life of this robot."""
        return str(self._phase), str(self._rate), str(self._fault_rate)

    def resume(self, phase: str, rate: str, fault_rate: str) -> None:
        """Run on as the clock whose `kept` returned these."""
        self._phase, self._rate, self._fault_rate = int(phase), int(rate), int(fault_rate)
        self._note_ideal()

    def reset(self) -> None:
        """Read `offset_ns` at this instant and forget all trims, as a counter that starts with the processor."""
        self._rate = UNIT + rate_parts(self.settings.drift_ppm) + self._fault_rate
        self._phase = self.settings.offset_ns * UNIT - self._rate * self._true_now()
        self._note_ideal()

    @property
    def drift_ppm(self) -> float:
        """Drift with all trims [ppm], for records: firmware cannot know it."""
        return float(self._rate - UNIT) / PARTS_PER_PPM

    def _note_ideal(self) -> None:
        self._ideal = self._phase == 0 and self._rate == UNIT and self._tick_ns == 1
