"""Gains gamma_n of the nominal system: one for each planned value of the inputs, and one for all of P.

The gains are data that nothing here checks. Differs from the dissertation, which calls 22, 53, 56 and 96 L2-gains of
the tracking loop: no finite number is one, since y~ is quadratic in x and the gain grows with the amplitude (`l2_gain`
finds 2.36 to 14.3 for small amplitudes). A given gain certifies nothing for larger states than those it was found for.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import NamedTuple, TypeVar

Row = TypeVar("Row")
SAME_INPUTS = 1e-6          # difference up to which inputs, rounded to float32 in a frame, are the planned ones


class RegionalGain(NamedTuple):
    gain_per_s: float
    radius: float               # largest |x| for which it counts


class GainTable:
    """gamma_n by inputs; `unified` (Z of Assumption 2) for inputs that are not in the table.

    `regional`: gains that count for small states alone, by inputs, for the policy `regional_gains`."""

    def __init__(self, gains: Mapping[tuple[float, ...], float], unified: float, same_within: float = SAME_INPUTS,
                 regional: Mapping[tuple[float, ...], RegionalGain] | None = None) -> None:
        for name, gain in (*((f"gains[{key}]", gain) for key, gain in gains.items()), ("unified", unified)):
            if not (isfinite(gain) and gain > 0):
                raise ValueError(f"{name}={gain}: expected a positive, finite gain")
        above = {key: gain for key, gain in gains.items() if gain > unified}
        if above:
            raise ValueError(f"unified={unified}: expected the largest gain of all inputs, but the table has {above}")
        self._gains = {tuple(key): gain for key, gain in gains.items()}
        self._regional = {tuple(key): RegionalGain(*row) for key, row in (regional or {}).items()}
        for key, row in self._regional.items():
            if not (0 < row.gain_per_s <= unified and row.radius > 0):
                raise ValueError(f"regional[{key}]={tuple(row)}: expected a gain above 0, at most the unified one, "
                                 f"{unified}, and a radius above 0")
        self.unified = unified
        self._same_within = same_within

    @property
    def rows(self) -> list[tuple[float, ...]]:
        """Return (inputs..., gain) of each entry, in the order of the table."""
        return [(*inputs, gain) for inputs, gain in self._gains.items()]

    def planned(self, inputs: tuple[float, ...]) -> bool:
        """Return whether the inputs are in the table."""
        return self._find(inputs) is not None

    def gain(self, inputs: tuple[float, ...]) -> float:
        found = self._find(inputs)
        return self.unified if found is None else found

    def regional(self, inputs: tuple[float, ...]) -> RegionalGain | None:
        """Return the gain of the inputs in a region; None if there is none."""
        return self._near(self._regional, inputs)

    def _find(self, inputs: tuple[float, ...]) -> float | None:
        return self._near(self._gains, inputs)

    def _near(self, table: Mapping[tuple[float, ...], Row], inputs: tuple[float, ...]) -> Row | None:
        found = table.get(inputs)
        if found is not None:
            return found
        for key, row in table.items():
            if all(abs(a - b) <= self._same_within for a, b in zip(key, inputs, strict=True)):
                return row
        return None
