"""The setting of sections 3.2.1 and 3.3.1 as NUMBERS fixes it: sensor, target, filter, and one run with them.

    R = 2.3 m, eta = R / 2, K = 1 /s, pursuer 2 m/s, target 0.7 m/s, T_s = 0.07 s, sigma = 0.1 m, rho = 0.2 m
    alternative: eta = 0.75 m, K = 1.5 /s; then zeta = 0.55 m costs no more looks than 0.45 m with the values above
    zeta   0.45 m for Tables 3.2 and 3.4; 0.55 m if no target may escape; 3 T_s v_max = 0.147 m as printed

Gamma = 17 for the circular path, else 3. The sensor starts at the target's place.
"""

from __future__ import annotations

import numpy as np

from agents.estimation.circle_filter import CircleFilter
from agents.estimation.paths import INSTANTS, PATHS, STEP_NS
from agents.pursuit.chase import Chase, chase
from agents.pursuit.evaders import Evader, OnPath, Runner
from agents.pursuit.law import PursuitLaw
from agents.pursuit.pursuer import Pursuer, adaptive_pursuer
from agents.pursuit.zones import Zones

RADIUS_M, V_MAX_MPS, SIGMA_M, RHO_M = 2.3, 0.7, 0.1, 0.2
TABLE_ZETA_M, SURE_ZETA_M, PRINTED_ZETA_M = 0.45, 0.55, 3 * STEP_NS * 1e-9 * V_MAX_MPS
CLOSER_ETA_M, CLOSER_GAIN_PER_S = 0.75, 1.5
EVADERS = (*PATHS, "runner")            # `runner` flees to the boundary


def pursuer(evader: str, zeta_m: float, *, sure: bool, rho_m: float = RHO_M, latency_steps: int = 0,
            losses: int = 0, eta_m: float = RADIUS_M / 2, gain_per_s: float = 1.0) -> Pursuer:
    """Return a pursuer of this setting; its filter always fits a circle, as for the tables."""
    estimator = CircleFilter(17 if evader == "circle" else 3, rho_m=rho_m, v_max_mps=V_MAX_MPS, sigma_m=SIGMA_M,
                             line_gate=False)
    return adaptive_pursuer(estimator, Zones(RADIUS_M, eta_m, zeta_m), PursuitLaw(gain_per_s), v_max_mps=V_MAX_MPS,
                            sigma_m=SIGMA_M, step_ns=STEP_NS, rho_m=rho_m, latency_ns=latency_steps * STEP_NS,
                            losses=losses, sure=sure)


def run(evader: str, zeta_m: float, seed: int, *, sure: bool, rho_m: float = RHO_M, latency_steps: int = 0,
        losses: int = 0, traced: bool = False, eta_m: float = RADIUS_M / 2, gain_per_s: float = 1.0) -> Chase:
    """Run one chase, whose result depends on the arguments only."""
    rng = np.random.default_rng((0, seed))
    target: Evader = Runner((0.0, 0.0), V_MAX_MPS, rng) if evader == "runner" else OnPath(PATHS[evader]())
    hunter = pursuer(evader, zeta_m, sure=sure, rho_m=rho_m, latency_steps=latency_steps, losses=losses,
                     eta_m=eta_m, gain_per_s=gain_per_s)
    return chase(hunter, target.place, target, rng, instants=INSTANTS, step_ns=STEP_NS, sigma_m=SIGMA_M,
                 latency_steps=latency_steps, lost_in_a_row=losses, traced=traced)
