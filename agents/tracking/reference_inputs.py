"""The nominal inputs omega^_p of the reference robot R2, constant on half-open pieces [start, next start).

A change of the inputs forces a transmission: T^delta is a part of T (Assumption 1).
Differs from the dissertation: the indicator function of the interval I is 1 on it, not t as printed.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import NamedTuple

from agents.tracking.controller import Inputs


class Piece(NamedTuple):
    start_ns: int
    inputs: Inputs


@dataclass(frozen=True)
class ReferenceInputs:
    pieces: Sequence[Piece]

    def __post_init__(self) -> None:
        starts = [piece.start_ns for piece in self.pieces]
        if not starts or starts[0] != 0 or any(a >= b for a, b in pairwise(starts)):
            raise ValueError(f"pieces start at {starts} ns: expected 0, then later and later instants")
        for piece in self.pieces:
            if not all(map(isfinite, piece.inputs)):
                raise ValueError(f"piece at {piece.start_ns} ns: inputs {tuple(piece.inputs)}: expected finite numbers")

    @property
    def changes_ns(self) -> tuple[int, ...]:
        return tuple(piece.start_ns for piece in self.pieces[1:])

    def at(self, t_ns: int) -> Inputs:
        return self.pieces[bisect_right(self.pieces, t_ns, key=lambda piece: piece.start_ns) - 1].inputs

