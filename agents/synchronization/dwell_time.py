"""May the topology switch? Certificates for switching at round ends (section 6.4).

With the exact round maps z -> M z (`exact_loop`) and quadratic functions V = z' P z:

CommonCertificate: one P with M' P M <= exp(-2 alpha h) P for every map of h seconds. Then any switching at round ends
decays: |z| <= sqrt(cond P) exp(-alpha t) |z(0)|. No dwell time is needed.

DwellCertificate: a P_p for each topology; V_p decays by rho_p per round and, after the first round since a switch, is
at most mu times the V_q before it. Then a dwell of m > 1 - ln mu / ln rho rounds suffices.

Differs from the dissertation:
- Section 6.5 takes min tau for an admissible dwell time because no destabilizing signal was found. There is one
  (`starving`), so topologies change only at the end of a complete round, and the certificates are for that;
- below (6.34), lambda0 = min c3 / (2 c2): from V' <= -c3 |z|^2 follows V' <= -(c3 / c2) V; with c1, as printed, the
  dwell time comes out too small.
Not modelled: disturbances and bias (the maps are those of d = 0, omega = 0), lost frames, interval arithmetic
(residuals are held against a bound on rounding errors, ROUNDING).
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

ROUNDING = 1e3 * float(np.finfo(float).eps)     # residuals count as positive above this part of the matrix norm
RATE_KEPT = 0.999                               # part of the rate found that is claimed, for room above ROUNDING


@dataclass(frozen=True, eq=False)
class RoundMap:
    """One complete round of topology `plan`; right after a switch from `after`, where that makes a difference."""

    plan: int
    M: Floats
    period_s: float
    after: int | None = None

    def __str__(self) -> str:
        return f"topology {self.plan}" if self.after is None else f"topology {self.plan} right after {self.after}"


def round_maps(agents: Sequence[LinearAgent], plans: Sequence[RoundPlan], hearing: Hearing = Hearing.NEIGHBOURS,
               delay_ns: int = 0) -> tuple[RoundMap, ...]:
    """Every map that a complete round can have when topologies switch at round ends only."""
    maps = []
    for p, plan in enumerate(plans):
        loop = ExactLoop(tuple(agents), plan.laplacian, plan.parts)
        tau_s, delay_s, period_s = plan.slot_ns * 1e-9, delay_ns * 1e-9, plan.round_ns * 1e-9
        maps.append(RoundMap(p, loop.round_map(tau_s, delay_s), period_s))
        if hearing is Hearing.NEIGHBOURS:
            maps += [RoundMap(p, loop.round_map(tau_s, delay_s, plans[q].laplacian), period_s, q)
                     for q in range(len(plans)) if q != p]
    return tuple(maps)


def _decay_problems(name: str, P_after: Floats, M: Floats, factor: float, P_before: Floats) -> list[str]:
    """What speaks against P_before > 0 and M' P_after M < factor P_before, beyond rounding."""
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
    """Any switching at round ends converges at `rate_per_s`, provided that `problems` finds nothing."""

    maps: tuple[RoundMap, ...]
    P: Floats
    rate_per_s: float

    def problems(self) -> list[str]:
        found = [] if self.rate_per_s > 0 else [f"the rate is {self.rate_per_s:.3g} per second: expected above 0"]
        for m in self.maps:
            found += _decay_problems(str(m), self.P, m.M, float(np.exp(-2 * self.rate_per_s * m.period_s)), self.P)
        return found

    @property
    def holds(self) -> bool:
        return not self.problems()

    @property
    def overshoot(self) -> float:
        """At round ends |z(t)| <= overshoot exp(-rate t) |z(0)|."""
        return float(np.sqrt(np.linalg.cond(self.P)))


@dataclass(frozen=True, eq=False)
class DwellCertificate:
    """Switching converges if each topology stays for `dwell_rounds` rounds, provided that `problems` finds nothing."""

    maps: tuple[RoundMap, ...]
    P: tuple[Floats, ...]       # one per topology
    rho: tuple[float, ...]      # V_p after a round <= rho_p V_p before
    mu: float                   # V_p after the first round of p <= mu V_q before, for every q != p
    dwell_rounds: int           # m

    @property
    def rate_per_s(self) -> float:
        """Least over p of -(ln mu + (m - 1) ln rho_p) / (2 m h_p): longer stays decay faster."""
        m = self.dwell_rounds
        periods_s = {each.plan: each.period_s for each in self.maps}
        return min(-(log(self.mu) + (m - 1) * log(rho)) / (2 * m * periods_s[p]) for p, rho in enumerate(self.rho))

    def problems(self) -> list[str]:
        found = [] if self.rate_per_s > 0 else [f"dwell_rounds={self.dwell_rounds}: mu rho^(m - 1) is not below 1"]
        for m in self.maps:
            if m.after is None:
                found += _decay_problems(str(m), self.P[m.plan], m.M, self.rho[m.plan], self.P[m.plan])
        for m, q in _first_rounds(self.maps):
            found += _decay_problems(f"{m} coming from {q}", self.P[m.plan], m.M, self.mu, self.P[q])
        return found

    @property
    def holds(self) -> bool:
        return not self.problems()


def _first_rounds(maps: Sequence[RoundMap]) -> list[tuple[RoundMap, int]]:
    """(map of the first round, topology before) for each switch; the ordinary map where nothing distinguishes it."""
    special = {(m.plan, m.after) for m in maps}
    plans = sorted({m.plan for m in maps})
    return [(m, q) for m in maps for q in plans
            if q != m.plan and (m.after == q or (m.after is None and (m.plan, q) not in special))]


def common_certificate(maps: Sequence[RoundMap]) -> CommonCertificate:
    """The best common function that the search finds; ask it whether it `holds`."""
    matrices, periods_s = [m.M for m in maps], [m.period_s for m in maps]
    P = search(matrices, periods_s)
    found = min(rates_per_s(P, matrices, periods_s))
    return CommonCertificate(tuple(maps), P, found - (1 - RATE_KEPT) * abs(found))


def dwell_certificate(maps: Sequence[RoundMap], share: float = 0.75) -> DwellCertificate:
    """One function per topology from discrete Lyapunov equations: rho_p = (spectral radius of M_p)^(2 share)."""
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
    """A common function if one is found, otherwise one per topology with a dwell; either checks itself."""
    common = common_certificate(maps)
    return common if common.holds else dwell_certificate(maps)


def average_dwell_time_s(c1: Sequence[float], c2: Sequence[float], c3: Sequence[float]) -> float:
    """ln mu / (2 lambda0), above which an average dwell time is admissible (6.35); constants of (6.29), (6.30)."""
    mu = max(c2) / min(c1)
    lambda0 = min(decay / (2 * upper) for decay, upper in zip(c3, c2, strict=True))
    return log(mu) / (2 * lambda0)
