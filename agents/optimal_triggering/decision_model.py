"""The decision problem tabulated over the points of an averager: costs, intervals, discounts and transitions.

    Q(i, j) = cost(i, j) + S + discount(i, j) sum over k of transitions(i, j; k) V(k)

Row i is a point x, column j a candidate interval tau(i, j); u is computed from y^ = x + nu, and the expectation is over
nu and e_omega. With a reference function a(x) = x'Px the averager holds V - a, whose
expectation is exact where a is large: the same problem (potential-based shaping, Ng, Harada and Russell 1999), with an
interpolation error proportional to V - a instead of V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from agents.optimal_triggering.averager import Averager
from agents.optimal_triggering.formulation import GAMMA, Formulation
from agents.optimal_triggering.held_loop import Floats, HeldLoop, flow
from agents.optimal_triggering.noise_points import NO_NOISE, NoisePoints, held_share

KNOT_S = 0.1                        # of e_omega, as in agents.tracking.noise


@dataclass(frozen=True, eq=False)
class DecisionModel:
    averager: Averager
    tau_s: Floats                   # shape (points, candidates)
    costs: Floats                   # the running cost over tau, shaped by a
    discounts: Floats
    transitions: csr_array          # shape (points * candidates, points)
    reference: Floats               # a at the points

    def lookahead(self, at_points: Floats, look_cost: float, rate: float = 0.0) -> Floats:
        """Return Q of shape (points, candidates), with `rate` times tau taken off (g of AVERAGE_COST)."""
        later = (self.transitions @ at_points).reshape(self.tau_s.shape)
        total: Floats = self.costs + look_cost - rate * self.tau_s + self.discounts * later
        return total


def tabulate(loop: HeldLoop, averager: Averager, tau_s: Floats, formulation: Formulation,
             noise: NoisePoints = NO_NOISE, *, gamma: float = GAMMA, shape: Floats | None = None) -> DecisionModel:
    """Tabulate the problem for candidate intervals tau_s of shape (points, candidates); `shape` is P of a(x) = x'Px."""
    points, (count, candidates), n = averager.points, tau_s.shape, noise.weights.size
    P = np.zeros((3, 3)) if shape is None else shape
    x = points[:, :, None]                                              # (3, points, 1)
    u = loop.command(x + noise.nu[:, None, :])                          # (2, points, noise)
    costs, rows = np.empty_like(tau_s), []
    discounts = formulation.discount(tau_s, gamma)
    here = np.einsum("ip,ij,jp->p", points, P, points)
    for j in range(candidates):
        tau = tau_s[:, j, None]
        inputs = loop.inputs(noise.e_omega[:, None, :] * held_share(tau, KNOT_S))
        after = flow(x, u, inputs, tau)
        costs[:, j] = loop.cost(x, u, inputs, tau) @ noise.weights
        costs[:, j] += discounts[:, j] * (np.einsum("ipn,ij,jpn->pn", after, P, after) @ noise.weights) - here
        found = averager.combine(after.reshape(3, -1))
        k = found.points.shape[0]
        of_row = np.broadcast_to(np.repeat(np.arange(count), n), (k, count * n)).ravel()
        weights = (found.weights * np.tile(noise.weights, count)).ravel()
        rows.append(csr_array((weights, (of_row, found.points.ravel())), shape=(count, count)))
    return DecisionModel(averager, tau_s, costs, discounts, _interleaved(rows, count, candidates), here)


def _interleaved(rows: list[csr_array], count: int, candidates: int) -> csr_array:
    """Return the matrix with row i * candidates + j from row i of rows[j]."""
    from scipy.sparse import vstack

    order = (np.arange(candidates) * count + np.arange(count)[:, None]).ravel()
    return csr_array(vstack(rows, format="csr")[order])
