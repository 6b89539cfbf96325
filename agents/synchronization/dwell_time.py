"""Certificates that the team synchronizes although the topology switches at ends of rounds (section 6.4).

With the exact round maps z -> M z (`exact_loop`) and quadratic functions V = z' P z:

CommonCertificate: one P with M' P M <= exp(-2 alpha h) P for every map of h seconds. Then any switching at round ends
decays: |z| <= sqrt(cond P) exp(-alpha t) |z(0)|. No dwell time is needed.

DwellCertificate: a P_p for each topology; V_p decays by rho_p per round and, after the first round since a switch, is
at most mu times the V_q before it. Then a dwell of m > 1 - ln mu / ln rho rounds suffices.

Differs from the dissertation:
- section 6.5 takes min tau as an admissible dwell time because no destabilizing signal was found. `starving` has one;
  so topologies change only at the end of a complete round, and the certificates hold for that;
- below (6.34), lambda0 = min c3 / (2 c2): from V' <= -c3 |z|^2 follows V' <= -(c3 / c2) V; with c1, as printed, the
  dwell time is too short.
Not modelled: disturbances and bias (the maps are those of d = 0, omega = 0), lost frames, interval arithmetic
(residuals are compared with a bound on rounding errors, ROUNDING).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log

import numpy as np

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.common_lyapunov import discrete_lyapunov, rates_per_s, search
from agents.synchronization.exact_loop import ExactLoop, Hearing, spectral_radius
from agents.synchronization.graph import Floats
from agents.synchronization.round_plan import RoundPlan

ROUNDING = 1e3 * float(np.finfo(float).eps)     # residuals are positive if above this share of the matrix norm
RATE_KEPT = 0.999                               # share of the rate found that is claimed, a margin above ROUNDING


@dataclass(frozen=True, eq=False)
class RoundMap:
    """The map of a complete round of topology `plan`: of any round, or of the first after a switch from `after`."""

    plan: int
    M: Floats
    period_s: float
    after: int | None = None

    def __str__(self) -> str:
        return f"topology {self.plan}" if self.after is None else f"topology {self.plan} right after {self.after}"


def round_maps(agents: Sequence[LinearAgent], plans: Sequence[RoundPlan], hearing: Hearing = Hearing.NEIGHBOURS,
               delay_ns: int = 0) -> tuple[RoundMap, ...]:
    """Return every map that a complete round can have if topologies switch only at ends of rounds."""
    maps = []
    for p, plan in enumerate(plans):
        loop = ExactLoop(tuple(agents), plan.laplacian, plan.parts)
        tau_s, delay_s, period_s = plan.slot_ns * 1e-9, delay_ns * 1e-9, plan.round_ns * 1e-9
        maps.append(RoundMap(p, loop.round_map(tau_s, delay_s), period_s))
        if hearing is Hearing.NEIGHBOURS:
            maps += [RoundMap(p, loop.round_map(tau_s, delay_s, plans[q].laplacian), period_s, q)
                     for q in range(len(plans)) if q != p]
    return tuple(maps)


def decay_problems(name: str, P_after: Floats, M: Floats, factor: float, P_before: Floats) -> list[str]:
    """Return a sentence for each of P_before > 0 and M' P_after M < factor P_before that fails, beyond rounding."""
    found = []
    scale = float(np.linalg.norm(P_before, 2) + np.linalg.norm(P_after, 2) * np.linalg.norm(M, 2) ** 2)
    for what, matrix in (("P", P_before), ("P - M' P M", factor * P_before - M.T @ P_after @ M)):
        smallest = float(np.linalg.eigvalsh((matrix + matrix.T) / 2)[0])
        if not smallest > ROUNDING * scale:
            found.append(f"{name}: the least eigenvalue of {what} is {smallest:.3g}, expected more than "
                         f"{ROUNDING * scale:.3g} (rounding)")
    return found


@dataclass(frozen=True, eq=False)
class CommonCertificate:
    """If `problems` is empty, the state converges at `rate_per_s` for any switching at ends of rounds."""

    maps: tuple[RoundMap, ...]
    P: Floats
    rate_per_s: float

    def problems(self) -> list[str]:
        found = [] if self.rate_per_s > 0 else [f"the rate is {self.rate_per_s:.3g} per second: expected above 0"]
        for m in self.maps:
            found += decay_problems(str(m), self.P, m.M, float(np.exp(-2 * self.rate_per_s * m.period_s)), self.P)
        return found

    @property
    def holds(self) -> bool:
        return not self.problems()

    @property
    def overshoot(self) -> float:
        """The factor in |z(t)| <= overshoot exp(-rate t) |z(0)|, for t at ends of rounds."""
        return float(np.sqrt(np.linalg.cond(self.P)))


@dataclass(frozen=True, eq=False)
class DwellCertificate:
    """If `problems` is empty, the state converges if each topology holds for at least `dwell_rounds` rounds."""

    maps: tuple[RoundMap, ...]
    P: tuple[Floats, ...]       # one per topology
    rho: tuple[float, ...]      # V_p after a round <= rho_p V_p before
    mu: float                   # V_p after the first round of p <= mu V_q before, for every q != p
    dwell_rounds: int           # m

    @property
    def rate_per_s(self) -> float:
        """The least over p of -(ln mu + (m - 1) ln rho_p) / (2 m h_p); longer dwells decay faster."""
        m = self.dwell_rounds
        periods_s = {each.plan: each.period_s for each in self.maps}
        return min(-(log(self.mu) + (m - 1) * log(rho)) / (2 * m * periods_s[p]) for p, rho in enumerate(self.rho))

    def problems(self) -> list[str]:
        found = [] if self.rate_per_s > 0 else [f"dwell_rounds={self.dwell_rounds}: mu rho^(m - 1) is not below 1"]
        for m in self.maps:
            if m.after is None:
                found += decay_problems(str(m), self.P[m.plan], m.M, self.rho[m.plan], self.P[m.plan])
        for m, q in _first_rounds(self.maps):
            found += decay_problems(f"{m} coming from {q}", self.P[m.plan], m.M, self.mu, self.P[q])
        return found

    @property
    def holds(self) -> bool:
        return not self.problems()


def _first_rounds(maps: Sequence[RoundMap]) -> list[tuple[RoundMap, int]]:
    """Return (map of the first round, topology before) for each switch; the ordinary map if there is no special one."""
    special = {(m.plan, m.after) for m in maps}
    plans = sorted({m.plan for m in maps})
    return [(m, q) for m in maps for q in plans
            if q != m.plan and (m.after == q or (m.after is None and (m.plan, q) not in special))]


def common_certificate(maps: Sequence[RoundMap]) -> CommonCertificate:
    """Return a certificate with the best common function found; its `holds` says whether it is valid."""
    matrices, periods_s = [m.M for m in maps], [m.period_s for m in maps]
    P = search(matrices, periods_s)
    found = min(rates_per_s(P, matrices, periods_s))
    return CommonCertificate(tuple(maps), P, found - (1 - RATE_KEPT) * abs(found))


def dwell_certificate(maps: Sequence[RoundMap], share: float = 0.75) -> DwellCertificate:
    """Return a certificate with a function per topology, from discrete Lyapunov equations.

    rho_p = (spectral radius of M_p)^(2 share). Raises ValueError unless 0 < share < 1."""
    if not 0 < share < 1:
        raise ValueError(f"share={share}: expected 0 < share < 1 of the decay of each topology")
    own = sorted((m for m in maps if m.after is None), key=lambda m: m.plan)
    rho = tuple(spectral_radius(m.M) ** (2 * share) for m in own)
    P = tuple(discrete_lyapunov(m.M / np.sqrt(r), np.eye(len(m.M))) for m, r in zip(own, rho, strict=True))
    growth = []
    for m, q in _first_rounds(maps):
        inverse = np.linalg.inv(np.linalg.cholesky(P[q]))
        growth.append(float(np.linalg.norm(inverse @ m.M.T @ P[m.plan] @ m.M @ inverse.T, 2)))
    mu = max([1.0, *growth]) / RATE_KEPT
    rounds = max(ceil(1 - log(mu) / log(r) + 1e-9) for r in rho)
    return DwellCertificate(tuple(maps), P, rho, mu, rounds)


def certify_switching(maps: Sequence[RoundMap]) -> CommonCertificate | DwellCertificate:
    """Return a certificate with a common function if it holds, otherwise one with a function per topology."""
    common = common_certificate(maps)
    return common if common.holds else dwell_certificate(maps)


def average_dwell_time_s(c1: Sequence[float], c2: Sequence[float], c3: Sequence[float]) -> float:
    """Return ln mu / (2 lambda0) [s], above which an average dwell time is admissible (6.35).

    c1, c2, c3 are the constants of (6.29) and (6.30), one per topology."""
    mu = max(c2) / min(c1)
    lambda0 = min(decay / (2 * upper) for decay, upper in zip(c3, c2, strict=True))
    return log(mu) / (2 * lambda0)
