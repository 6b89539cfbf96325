"""One incoming line at a robot: the wave in use, its integral, and the energy that the line still owes.

A wave w that came at a is in use until the next one comes. With `hold` that is all; otherwise it is in use for at most
the period tau of its sender, [a, a + tau), and then the wave is 0 until the next one.

    owed(t) = sum of tau v_n^2 over all waves that the sender sent, up to the one that came last - integral of w^2 to t

It is the energy that the line took, without the waves still under way, less what it gave out. It is never negative for
waves used for at most tau each. A line that owes less than 0 has given energy that it never got: its delay grew, or a
wave was lost, and the receiver held the one before for longer than tau. Waves under way add to int (v^2 - w^2) dt, the
energy in the line, so that is never less than `owed`.

Invariants
- A frame older than the newest one, or a copy of it, is not used.
- The account of waves that are over is in `_settled`: exactly 0 as long as each was used for tau.

Frames bear the sender's slot number, and the energy that it has sent on this line in all. From it the receiver learns
the energy of the frames that it did not get. After a restart of the sender it counts these as 0.
"""

from __future__ import annotations

from math import floor
from typing import Final

NEVER_S: Final = 1e8            # three years: time after which a break is none of this run


class IncomingWave:
    def __init__(self, period_ns: int, round_slots: int, *, hold: bool) -> None:
        """`period_ns`, `round_slots`: time and slot numbers between two frames of the sender."""
        self._period_ns, self._round_slots, self._hold = period_ns, round_slots, hold
        self.wave = 0.0
        self._slot = -1                     # of the newest frame
        self._sent = 0.0                    # the sender's account in the newest frame
        self._settled = 0.0                 # owed by the waves that are no longer in use
        self._since_ns = 0                  # when the present wave came
        self._silent = True                 # no wave is in use
        self._integral = 0.0                # of w up to `_counted_ns`
        self._counted_ns = 0

    def arrive(self, slot: int, wave: float, sent: float, now_ns: int) -> bool:
        """Use a wave from now on; return False for a frame that is not newer than the newest."""
        if slot <= self._slot:
            return False
        self._settle(now_ns)
        if slot - self._slot > self._round_slots:       # frames in between did not come
            self._settled += max(0.0, sent - self._sent - self._energy(wave, self._period_ns))
        self.wave, self._slot, self._sent, self._since_ns, self._silent = wave, slot, sent, now_ns, False
        return True

    def fall_silent(self, now_ns: int) -> None:
        """Let the wave be 0 from now on, a period after the newest one came."""
        self._settle(now_ns)
        self.wave, self._silent = 0.0, True

    @property
    def ends_ns(self) -> int | None:
        """When to call `fall_silent` unless another wave comes; None: never."""
        return None if self._hold or self._silent else self._since_ns + self._period_ns

    @property
    def breaks_ns(self) -> int | None:
        """The first local time at which the line owes less than 0 unless another wave comes; None: never."""
        power = self.wave * self.wave
        if not self._hold or self._silent or self._settled >= NEVER_S * power:
            return None
        credit_s = self._settled / power if self._settled > -NEVER_S * power else -NEVER_S
        lasts_ns = self._period_ns + floor(credit_s * 1e9)
        at_ns = self._since_ns + max(0, lasts_ns - 1)
        while self.owed(at_ns) >= 0:            # a few times, as the division is rounded
            at_ns += 1
        return at_ns

    def owed(self, now_ns: int) -> float:
        if self._silent:
            return self._settled
        return self._settled + self._energy(self.wave, self._period_ns - (now_ns - self._since_ns))

    def take_integral(self, now_ns: int) -> float:
        """Return the integral [s] of the wave in use since the last call."""
        self._count(now_ns)
        taken, self._integral = self._integral, 0.0
        return taken

    def _settle(self, now_ns: int) -> None:
        self._count(now_ns)
        self._settled = self.owed(now_ns)

    def _count(self, now_ns: int) -> None:
        self._integral += self.wave * ((now_ns - self._counted_ns) * 1e-9)
        self._counted_ns = now_ns

    @staticmethod
    def _energy(wave: float, for_ns: int) -> float:
        return wave * wave * (for_ns * 1e-9)
