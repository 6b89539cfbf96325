"""The outcome of a guarantee: `guarantees.json` of the run folder is a list of `Outcome`.

A violation is a longest interval [from_ns, until_ns) in which one subject violates the guarantee; it is empty if a
program reported two values at one instant.
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
    node: str                       # the receiver or sender, or the node with the signal
    from_ns: int
    until_ns: int
    worst: float | None             # in the unit of the bound; None if not finite
    cause: str


@dataclass(frozen=True)
class Finding:
    """The result of a monitor.

    `worst` and `margin` are over the whole run, also if nothing is violated, and None if nothing was measured. The
    margin is the distance to the bound, negative beyond it.
    """

    violations: Sequence[Violation] = ()
    worst: float | None = None
    margin: float | None = None
    judged: bool = True             # False if the run has no records of its subjects
    why: str = ""                   # the reason for that, "" if it is unknown


class Standing(msgspec.Struct, frozen=True):
    """The summary of one guarantee, as in `summary.json`."""

    name: str
    kind: str
    on: str
    requires: str                   # the guarantee in words
    unit: str                       # of worst and margin
    expected: Expected
    judged: bool
    violations: int
    first: Violation | None
    violated_ns: int                # time during which at least one subject violated it
    worst: float | None
    margin: float | None
    why: str = ""                   # reason why it was not judged, "" if it is unknown
    share: float | None = None      # of a campaign's runs that have to be as expected; a single run need not be

    @property
    def as_expected(self) -> bool:
        return self.judged and (self.share is not None or (self.violations > 0) == (self.expected == "violated"))

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
    """Return `value`, or None for inf and nan, for which JSON has no number."""
    return value if value is not None and isfinite(value) else None


def seconds(time_ns: int) -> str:
    """Write an instant exactly: 0.36 s, 1.000000001 s."""
    whole, rest = divmod(abs(time_ns), 10**9)
    return f"{'-' if time_ns < 0 else ''}{whole}.{rest:09d}".rstrip("0").rstrip(".") + " s"
