"""Whether a robot's slot clock is in step with those that it hears, and for how many rounds it may be out of step.

A clock is out of step if it is further from the mean of those heard than `far_ns`, which no drift explains. With steps
without bound the differences shrink by `contraction` per round (`slot_sync_condition`), so from e to far_ns in

    rounds = ceil(ln(e / far_ns) / ln(1 / contraction))

if no frame is lost. While clocks are out of step frames collide, so a robot waits for twice as many before it reports
that its clock does not settle.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from math import ceil, log
from statistics import fmean

from netem.wire.level import Level


class InStep:
    """Yields events, (kind, detail, level), at the ends of rounds; `contraction` 0: unknown, so nothing is late."""

    def __init__(self, far_ns: int, contraction: float) -> None:
        self._far_ns, self._contraction = far_ns, contraction
        self._rounds = 0            # since the clock is out of step, 0 while it is in step
        self._largest_ns = 0.0      # error since then

    def close_round(self, errors_ns: Collection[int]) -> Iterator[tuple[str, str, Level]]:
        """Take the errors of the clocks heard in this round."""
        error_ns = fmean(errors_ns) if errors_ns else 0.0
        if abs(error_ns) >= self._far_ns > 0:
            if not self._rounds:
                yield ("clock out of step", f"it is {error_ns:.0f} ns ahead of those that it hears: expected less than "
                                            f"{self._far_ns} ns", Level.WARNING)
            self._largest_ns = max(self._largest_ns, abs(error_ns))
        elif not self._rounds:
            return
        elif errors_ns:
            yield "clock in step again", f"after {self._rounds} rounds", Level.INFO
            self._rounds, self._largest_ns = 0, 0.0
            return
        self._rounds += 1
        if self._rounds == self.rounds_allowed() + 1:
            yield ("clock does not settle", f"it is out of step for more than {self.rounds_allowed()} rounds: the "
                                            "robot's frames collide, or it hears no other robot", Level.WARNING)

    def rounds_allowed(self) -> int:
        """Twice the rounds in which an error of the largest size shrinks to far_ns; 0 if that is not known."""
        if not 0 < self._contraction < 1 or self._largest_ns <= self._far_ns:
            return 2 if self._contraction else 0
        return 2 * max(1, ceil(log(self._largest_ns / self._far_ns) / log(1 / self._contraction)))
