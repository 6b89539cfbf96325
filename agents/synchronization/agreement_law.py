"""The control law with held outputs (6.11):

    u_i = -K_i sum_{j in N_i} [(yh_i - yh_j) - (d_i - d_j)]         yh: the value last broadcast, held (zero order)

A robot leaves out the term of a neighbour until it has received a value from it. The term of a neighbour that is new in
N_i acts from its next slot on, or at once if its value was received since the last slot of the old topology.

Errors are summed over j ascending, each term as (own - other) - offset, as in C (docs/firmware.md, shared arithmetic).

Differs from the dissertation, which does not say what a receiver uses before the first frame of a new link.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from agents.synchronization.graph import Floats

Output = tuple[float, ...]


class AgreementLaw:
    """One robot's side of (6.11). Robots are numbered from 0."""

    def __init__(self, number: int, K: Floats, biases: Sequence[Output]) -> None:
        self.number = number
        self.neighbours: tuple[int, ...] = ()
        self.held: dict[int, Output] = {}
        self._gain = [[float(entry) for entry in row] for row in K]
        self._gains = [row[0] for row in self._gain]        # the whole matrix, if there is one output
        self._offsets = [tuple(mine - theirs for mine, theirs in zip(biases[number], bias, strict=True))
                         for bias in biases]                    # d_i - d_j

    def listen_to(self, neighbours: Iterable[int], fresh: Iterable[int]) -> None:
        """Set N_i to `neighbours`; drop the values held of new neighbours, unless they are in `fresh`."""
        kept = set(self.neighbours) | set(fresh) | {self.number}
        self.neighbours = tuple(sorted(neighbours))
        self.held = {number: value for number, value in self.held.items() if number in kept}

    def control(self) -> list[float]:
        """Return u_i without disturbance; zero until the robot's own first broadcast."""
        held, offsets = self.held, self._offsets
        own = held.get(self.number)
        if own is None:
            return [0.0] * len(self._gain)
        if len(own) == 1:                       # one output: the common case, kept fast
            value, error = own[0], 0.0
            for j in self.neighbours:
                if j in held:
                    error += value - held[j][0] - offsets[j][0]
            return [-gain * error for gain in self._gains]
        errors = [0.0] * len(own)
        for j in self.neighbours:
            if j in held:
                other, offset = held[j], offsets[j]
                for k, value in enumerate(own):
                    errors[k] += value - other[k] - offset[k]
        return [-_product(row, errors) for row in self._gain]


def _product(row: Sequence[float], errors: Sequence[float]) -> float:
    """Return row times errors, summed from the first term on: the built-in `sum` is compensated from Python 3.12 on."""
    total = row[0] * errors[0]
    for k in range(1, len(errors)):
        total += row[k] * errors[k]
    return total
