"""Conditions under which no target escapes (Theorem 1, extended by latency, losses and noise).

    zeta  >= (2 T_s + latency + losses (T_s + latency)) v_max + 4.5 sigma
    K eta >= v_max,  u_max > v_max                  outside the no-moving area the pursuer is at least as fast
    eta   <= R - zeta - 3 T_s v_max                 a look makes the next one due only some instants later

Proof: at the last instant before a look is due, R - |y - q| - v_max (t - t_seen) > zeta. A look that is due at k is
exposed at k + 1 and answered `latency` later; without an answer by then it is repeated at the next instant. Until the
answer the pursuer does not recede from y, and y is wrong by at most 4.5 sigma, so the target is in view when exposed.
4.5 sigma: a normally distributed detection in the plane has a larger error once in 25 000 looks, in any direction.

Differs from the dissertation, which has zeta >= 3 T_s v_max with "almost surely" and no margin for noise: a target that
flees to the boundary then escapes.
"""

from __future__ import annotations

from agents.pursuit.law import PursuitLaw
from agents.pursuit.zones import Zones

NOISE_SIGMAS = 4.5
SPARE_STEPS = 3


def least_escape_m(v_max_mps: float, sigma_m: float, step_ns: int, latency_ns: int = 0, losses: int = 0) -> float:
    """Return the least zeta [m] with which no target escapes, if at most `losses` answers are lost in a row."""
    if latency_ns < 0 or losses < 0:
        raise ValueError(f"latency_ns={latency_ns}, losses={losses}: expected 0 or more")
    unseen_ns = 2 * step_ns + latency_ns + losses * (step_ns + latency_ns)
    return unseen_ns * 1e-9 * v_max_mps + NOISE_SIGMAS * sigma_m


def problems(zones: Zones, law: PursuitLaw, v_max_mps: float, sigma_m: float, step_ns: int,
             latency_ns: int = 0, losses: int = 0) -> list[str]:
    """Return one sentence for each violated condition; empty: no target escapes."""
    found = []
    least_m = least_escape_m(v_max_mps, sigma_m, step_ns, latency_ns, losses)
    if zones.escape_m < least_m * (1 - 1e-12):
        found.append(f"escape_m={zones.escape_m}: a target of {v_max_mps} m/s, seen with sigma = {sigma_m} m, can get "
                     f"out between two looks; take {least_m:.4g} m or more")
    if law.gain_per_s * zones.no_moving_m < v_max_mps:
        found.append(f"no_moving_m={zones.no_moving_m}: with a gain of {law.gain_per_s} /s the pursuer is slower than "
                     f"the target, {v_max_mps} m/s, near it; take {v_max_mps / law.gain_per_s:.4g} m or more, or more "
                     f"gain")
    if law.u_max_mps <= v_max_mps:
        found.append(f"u_max_mps={law.u_max_mps}: the pursuer has to be faster than the target, {v_max_mps} m/s")
    most_m = zones.radius_m - zones.escape_m - SPARE_STEPS * step_ns * 1e-9 * v_max_mps
    if zones.no_moving_m > most_m:
        found.append(f"no_moving_m={zones.no_moving_m}: the field of view is too small for its zones; take at most "
                     f"{most_m:.4g} m, or a radius of {zones.radius_m + zones.no_moving_m - most_m:.4g} m or more")
    return found
