"""Algorithm 1: sets of agents that may broadcast at the same instant without a collision (Problem 5).

Two agents share a part if the element-wise product of their columns of L vanishes: no agent hears both and neither
hears the other (the radio network model). The parts are filled greedily in the order of the agents' numbers.

Differs from the dissertation: line 7 of Algorithm 1 also requires that agent j has no part yet; as printed, an agent
in an earlier part can be put into a second one.
Not modelled: the fewest parts possible (that is graph colouring); interference beyond the links of L.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agents.synchronization.graph import Floats

Parts = tuple[tuple[int, ...], ...]


def may_share_a_part(L: Floats, i: int, j: int) -> bool:
    """Return whether L(i).L(j) = 0_N: the agents have no common receiver, and neither receives from the other."""
    return not np.any(L[:, i] * L[:, j])


def partition(L: Floats) -> Parts:
    """Return the nonempty parts P_1, ..., P_T, each ascending, in the order in which they broadcast."""
    parts: list[list[int]] = []
    unassigned = set(range(len(L)))
    for i in range(len(L)):
        if i not in unassigned:
            continue
        part = [i]
        unassigned.remove(i)
        for j in range(i + 1, len(L)):
            if j in unassigned and all(may_share_a_part(L, member, j) for member in part):
                part.append(j)
                unassigned.remove(j)
        parts.append(part)
    return tuple(tuple(part) for part in parts)


def colliding_pairs(L: Floats, parts: Sequence[Sequence[int]]) -> list[tuple[int, int]]:
    """Return the pairs of agents within one part whose broadcasts would collide."""
    return [(i, j) for part in parts for k, i in enumerate(part) for j in part[k + 1:]
            if not may_share_a_part(L, i, j)]
