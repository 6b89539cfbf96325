"""What has to hold so that no target escapes (Theorem 1, with room for what it leaves out).

    zeta  >= (2 T_s + latency + losses (T_s + latency)) v_max + 4.5 sigma
    K eta >= v_max,  u_max > v_max                  where it has to follow it is not slower than the target
    eta   <= R - zeta - 3 T_s v_max                 after a look it is not at once in doubt again

Why: at the last instant without doubt, R - |y - q| - v_max (t - t_seen) > zeta. A look that is due at k is taken at
k + 1 and told of `latency` later; one without an answer by then is taken again at the next instant. Until the news the
pursuer does not recede from y, and y is off by no more than 4.5 sigma, so the target is inside when it is looked at.
4.5 sigma: a normal detection in the plane is farther off once in 25 000 looks, and then in any direction.

Differs from the dissertation: it has zeta >= 3 T_s v_max with "almost surely", without room for the noise; a target
that runs for the boundary then escapes.
"""

from __future__ import annotations

from agents.pursuit.law import PursuitLaw
from agents.pursuit.zones import Zones

NOISE_SIGMAS = 4.5
SPARE_STEPS = 3


def least_escape_m(v_max_mps: float, sigma_m: float, step_ns: int, latency_ns: int = 0, losses: int = 0) -> float:
    """The narrowest escape area that is sure, with at most so many answers lost in a row."""
    if latency_ns < 0 or losses < 0:
        raise ValueError(f"latency_ns={latency_ns}, losses={losses}: expected 0 or more")
    unseen_ns = 2 * step_ns + latency_ns + losses * (step_ns + latency_ns)
    return unseen_ns * 1e-9 * v_max_mps + NOISE_SIGMAS * sigma_m


def problems(zones: Zones, law: PursuitLaw, v_max_mps: float, sigma_m: float, step_ns: int,
             latency_ns: int = 0, losses: int = 0) -> list[str]:
    """What is not as the theorem needs it, one a line; empty: no target escapes."""
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
