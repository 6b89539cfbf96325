"""Convergence rate of resynchronization, from the eigenvalues of the map of one round.

Let x be the offsets, v = round * (drift + trims) the change of each offset per round, and s_i the mean error that i has
collected. A round is, for part p = 0, ..., T - 1 (alpha = airtime / slot, n_i = number of nodes that i hears),

    all i that hear a sender j of part p:                s_i <- s_i + (x_i - x_j + alpha v_i / T) / n_i
    the senders themselves, if they close now:           x <- x - gain s,  v <- v - rate_gain gain s,  s <- 0
    all:                                                 x <- x + v / T

and, if rounds are closed at their end, the second line for all at the end. The term in alpha is the receiver's own
drift during the frame, since `SlotSync` subtracts the airtime as local time. The map is linear. Relevant are the
differences of x to one node (a reference, if there is one) and v. They converge to 0 iff the eigenvalues of the map lie
inside the unit circle; the largest |eigenvalue| is the factor per round. Without trims, closed at the end, it is the
second largest |eigenvalue| of W (see `slot_sync`).

Source: Carli, Chiuso, Schenato & Zampieri, IFAC World Congress 2008 (consensus on offset and rate); the map with slots
is derived here and tested against clocks in true time.
Not modelled: the bound on a step, the median, lost frames.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np


def contraction_per_round(hears: Mapping[str, Collection[str]], parts: Mapping[str, int], gain: float,
                          rate_gain: float = 0.0, *, references: Collection[str] = (), own_slot: bool = False,
                          airtime_share: float = 0.0) -> float:
    """Return the factor by which differences between clocks shrink per round in the long run; >= 1: they do not.

    `hears[i]` are the nodes that i hears, `parts[i]` its part, 0 <= part < T, `airtime_share` is airtime / slot. With
    `own_slot` a node closes its round just after sending, otherwise at the round's end. Without `rate_gain` drifts are
    constant, and the factor is that of the offsets.
    """
    names = list(hears)
    number = {name: i for i, name in enumerate(names)}
    ears = [[number[speaker] for speaker in hears[name]] if name not in references else [] for name in names]
    part_of = [parts[name] for name in names]
    N, T = len(names), max(part_of) + 1
    if _roots(ears) > 1:
        return 1.0

    # A row holds how a quantity depends on the state at the round's start: x in columns 0.., v in N.., s in 2N...
    x, v, s = (np.eye(3 * N)[i * N:(i + 1) * N] for i in range(3))
    if rate_gain == 0:
        v = np.zeros_like(v)

    def close(nodes: Collection[int]) -> None:
        for i in nodes:
            x[i] -= gain * s[i]
            v[i] -= rate_gain * gain * s[i]
            s[i] = 0.0

    for part in range(T):
        for i, heard in enumerate(ears):
            for j in heard:
                if part_of[j] == part:
                    s[i] += (x[i] - x[j] + airtime_share / T * v[i]) / len(heard)
        if own_slot:
            close([i for i in range(N) if part_of[i] == part])
        x += v / T
    if not own_slot:
        close(range(N))

    listeners = [i for i in range(N) if ears[i]]
    base = next((i for i in range(N) if not ears[i]), 0)
    x -= x[base].copy()
    state = [i for i in range(N) if i != base]
    if rate_gain > 0:
        if airtime_share == 0 and len(listeners) == N:      # a drift common to all nodes is not observable
            v -= v[base].copy()
            listeners.remove(base)
        state += [N + i for i in listeners]
    if own_slot:
        state += [2 * N + i for i in range(N) if ears[i]]
    round_map = np.vstack([x, v, s])[np.ix_(state, state)]
    return float(max(abs(np.linalg.eigvals(round_map)), default=0.0))


def _roots(ears: list[list[int]]) -> int:
    """Return the number of groups of nodes that hear no node outside the group; with more than one, clocks diverge."""
    L = np.zeros((len(ears), len(ears)))
    for i, heard in enumerate(ears):
        for j in heard:
            L[i, i] += 1
            L[i, j] -= 1
    return len(ears) - int(np.linalg.matrix_rank(L))
