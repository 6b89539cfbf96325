"""What a search may draw of a kind of fault in a scenario: a target, and a range for each field.

    Candidate("radio", {"nodes": Fixed(("r1",)), "sensed": OneOf((True, False))}) --draw--> the fields of one fault

Times are shares of the length of the run, so that a draw makes sense in a run of any length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any, Final, Protocol

DIGITS: Final = 4               # of a number that is drawn, so that a reader can read it


class Range(Protocol):
    def draw(self, rng: Random, length_ns: int) -> Any:
        """Return a value at random, for a run of `length_ns`."""


@dataclass(frozen=True)
class Fixed:
    value: Any

    def draw(self, rng: Random, length_ns: int) -> Any:
        return self.value


@dataclass(frozen=True)
class OneOf:
    values: Sequence[Any]

    def draw(self, rng: Random, length_ns: int) -> Any:
        return self.values[int(rng.random() * len(self.values))]


@dataclass(frozen=True)
class Between:
    """A number in (least, most], of either sign if `signed`."""

    least: float
    most: float
    signed: bool = False

    def draw(self, rng: Random, length_ns: int) -> float:
        value = self.most - (self.most - self.least) * rng.random()
        value = float(f"{value:.{DIGITS}g}") or self.most           # never 0 by rounding
        return -value if self.signed and rng.random() >= 0.5 else value


@dataclass(frozen=True)
class Vector:
    """As many numbers as `size`, each of either sign and of a magnitude in (0, most]."""

    size: int
    most: float

    def draw(self, rng: Random, length_ns: int) -> tuple[float, ...]:
        return tuple(Between(0.0, self.most, signed=True).draw(rng, length_ns) for _ in range(self.size))


@dataclass(frozen=True)
class ShareOfLength:
    """A time from 1 ns to the share `most` of the run [ns], of either sign if `signed`."""

    most: float
    signed: bool = False

    def draw(self, rng: Random, length_ns: int) -> int:
        time_ns = 1 + int(rng.random() * length_ns * self.most)
        return -time_ns if self.signed and rng.random() >= 0.5 else time_ns


@dataclass(frozen=True)
class Candidate:
    """A fault with the text `on` for its target; fields that `ranges` leaves out keep their defaults."""

    on: str
    ranges: Mapping[str, Range] = field(default_factory=dict)

    def draw(self, rng: Random, length_ns: int) -> dict[str, Any]:
        return {name: of.draw(rng, length_ns) for name, of in self.ranges.items()}
