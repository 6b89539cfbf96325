"""Gains gamma_n of the nominal system, one for each value of the inputs that is planned, and one for all of P.

The gains are given data: nothing here checks them. Differs from the dissertation: it calls 22, 53, 56 and 96 L2-gains
of the tracking loop. No finite number is one, since y~ is quadratic in x and the gain grows with the amplitude
(`l2_gain` finds 2.36 to 14.3 for small ones). What they promise ends where states are larger than those they are for.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

SAME_INPUTS = 1e-6          # inputs that went through a frame's float32 are still the planned ones


class GainTable:
    """gamma_n by inputs; `unified` (Z of Assumption 2) for all that are not in the table."""

    def __init__(self, gains: Mapping[tuple[float, ...], float], unified: float,
                 same_within: float = SAME_INPUTS) -> None:
        for name, gain in (*((f"gains[{key}]", gain) for key, gain in gains.items()), ("unified", unified)):
            if not (isfinite(gain) and gain > 0):
                raise ValueError(f"{name}={gain}: expected a positive, finite gain")
        above = {key: gain for key, gain in gains.items() if gain > unified}
        if above:
            raise ValueError(f"unified={unified}: expected the largest gain of all inputs, but the table has {above}")
        self._gains = {tuple(key): gain for key, gain in gains.items()}
        self.unified = unified
        self._same_within = same_within

    def planned(self, inputs: tuple[float, ...]) -> bool:
        """Whether the inputs are in the table."""
        return self._find(inputs) is not None

    def gain(self, inputs: tuple[float, ...]) -> float:
        found = self._find(inputs)
        return self.unified if found is None else found

    def _find(self, inputs: tuple[float, ...]) -> float | None:
        found = self._gains.get(inputs)
        if found is not None:
            return found
        for key, gain in self._gains.items():
            if all(abs(a - b) <= self._same_within for a, b in zip(key, inputs, strict=True)):
                return gain
        return None
