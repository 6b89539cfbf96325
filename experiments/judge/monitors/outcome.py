"""What became of a guarantee: `guarantees.json` of the run folder is a list of `Outcome`.

A violation is a stretch [from_ns, until_ns) of time, as long as can be, over which one subject does not keep to what
is guaranteed; it is empty where a program told two values at one instant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Literal

import msgspec

Expected = Literal["holds", "violated"]


class Violation(msgspec.Struct, frozen=True):
    on: str                         # "radio: r1 -> r2", "r1.gain_product"
    node: str                       # whom it concerns: the receiver, the sender, the node with the signal
    from_ns: int
    until_ns: int
    worst: float | None             # in the unit of the bound; None: not finite
    cause: str


@dataclass(frozen=True)
class Finding:
    """What a monitor finds. `worst` and `margin` are over the whole run, also where nothing is violated; the margin is
    what is left to the bound, negative beyond it. None where there was nothing to measure."""

    violations: Sequence[Violation] = ()
    worst: float | None = None
    margin: float | None = None
    judged: bool = True             # False: the run has nothing to judge it by
    why: str = ""                   # it has nothing, where that is known


class Standing(msgspec.Struct, frozen=True):
    """One guarantee in short, as in `summary.json`."""

    name: str
    kind: str
    on: str
    requires: str                   # what is guaranteed, in words
    unit: str                       # of worst and margin
    expected: Expected
    judged: bool
    violations: int
    first: Violation | None
    violated_ns: int                # how long at least one subject did not keep to it
    worst: float | None
    margin: float | None
    why: str = ""                   # the run has nothing to judge it by, where that is known

    @property
    def as_expected(self) -> bool:
        return self.judged and (self.violations > 0) == (self.expected == "violated")

    def in_words(self) -> str:
        if not self.judged:
            return self.why or "the run has nothing to judge it by"
        if self.first is None:
            return "never violated"
        times = "once" if self.violations == 1 else f"{self.violations} times"
        return (f"violated {times}, {seconds(self.violated_ns)} in all, first at {seconds(self.first.from_ns)} on "
                f"{self.first.on}: {self.first.cause}")


class Outcome(msgspec.Struct, frozen=True):
    standing: Standing
    violations: list[Violation]     # by (from_ns, on)


def finite(value: float | None) -> float | None:
    """What JSON has a number for; None for the rest."""
    return value if value is not None and isfinite(value) else None


def seconds(time_ns: int) -> str:
    """Exact: 0.36 s, 1.000000001 s."""
    whole, rest = divmod(abs(time_ns), 10**9)
    return f"{'-' if time_ns < 0 else ''}{whole}.{rest:09d}".rstrip("0").rstrip(".") + " s"
