"""Expected places that depend on the time alone, for a filter whose `expect` draws random numbers (`ParticleFilter`).

    newest detection at t_n     places at t_n, t_n + step, t_n + 2 step, ...  by a copy of the filter, as far as needed
    in between                  the straight line from one place to the next

A filter that is asked directly draws random numbers at each call of `expect`; a recorder that samples the expected
place would then change what the robot does.
"""

from __future__ import annotations

from copy import deepcopy

from agents.estimation import Estimator, Inputs


class PredictedPath:
    """Invariant: the filter itself is asked for no place; only `correct` changes its random stream."""

    def __init__(self, estimator: Estimator, start_ns: int, step_ns: int) -> None:
        """`start_ns`: time of the filter's initial state."""
        if step_ns < 1:
            raise ValueError(f"step_ns={step_ns}: expected 1 or more")
        self._estimator, self._step_ns = estimator, step_ns
        self._from_ns = start_ns                        # t_n
        self._ahead: Estimator | None = None            # the copy, at the last of the places
        self._places: list[tuple[float, float]] = []

    def expect(self, t_ns: int) -> tuple[float, float]:
        if t_ns < self._from_ns:
            raise ValueError(f"expected position at {t_ns} ns: the filter is at {self._from_ns} ns already; ask in "
                             "order")
        steps, rest_ns = divmod(t_ns - self._from_ns, self._step_ns)
        x, y = self._place(steps)
        if not rest_ns:
            return x, y
        next_x, next_y = self._place(steps + 1)
        share = rest_ns / self._step_ns
        return x + share * (next_x - x), y + share * (next_y - y)

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs | None = None) -> bool:
        if not self._estimator.correct(t_ns, x_m, y_m, inputs):
            return False
        self._from_ns, self._ahead = t_ns, None
        self._places.clear()
        return True

    def _place(self, steps: int) -> tuple[float, float]:
        if self._ahead is None:
            self._ahead = deepcopy(self._estimator)
        while len(self._places) <= steps:
            self._places.append(self._ahead.expect(self._from_ns + len(self._places) * self._step_ns))
        return self._places[steps]
