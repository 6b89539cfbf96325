"""Counts escapes of a target, looks, and the least true distance to the boundary of the view, over many chases.

    python -m benchmarks.no_escape [--runs 1000]

Evaders: the circular path, the zig-zag, one that runs for the boundary. Escape areas: one that excludes escapes (0.55
m, and 0.70 m if answers are 3 steps late), that of Tables 3.2 and 3.4 (0.45 m), the printed 3 T_s v_max (0.147 m).
A pursuer that keeps closer (eta = 0.75 m, K = 1.5 /s) excludes escapes with no more looks than Tables 3.2 and 3.4 have.
Exits with 1 if a target escapes although that is excluded, or a pursuer needs more looks than allowed.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from agents.estimation.paths import STEP_NS
from agents.pursuit.section_3_3 import (
    CLOSER_ETA_M,
    CLOSER_GAIN_PER_S,
    EVADERS,
    PRINTED_ZETA_M,
    RADIUS_M,
    SURE_ZETA_M,
    TABLE_ZETA_M,
    V_MAX_MPS,
    run,
)

LATE_STEPS = 3
LATE_ZETA_M = SURE_ZETA_M + LATE_STEPS * STEP_NS * 1e-9 * V_MAX_MPS
ETA_M, GAIN_PER_S = RADIUS_M / 2, 1.0
# escape area, no-moving area, gain, steps that answers are late, whether no target may escape
SETTINGS = ((SURE_ZETA_M, CLOSER_ETA_M, CLOSER_GAIN_PER_S, 0, True), (SURE_ZETA_M, ETA_M, GAIN_PER_S, 0, True),
            (LATE_ZETA_M, ETA_M, GAIN_PER_S, LATE_STEPS, True), (TABLE_ZETA_M, ETA_M, GAIN_PER_S, 0, False),
            (PRINTED_ZETA_M, ETA_M, GAIN_PER_S, 0, False))
MOST_LOOKS = {(evader, zeta_m, eta_m): most for evader, most in (("circle", 22.6 + 0.6), ("zig-zag", 29.2 + 1.0))
              for zeta_m, eta_m in ((TABLE_ZETA_M, ETA_M), (SURE_ZETA_M, CLOSER_ETA_M))}      # means


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    runs = parser.parse_args().runs
    wrong = 0
    print("evader   zeta [m]  eta [m]  K [1/s]  late [steps]  looks: mean  most  least distance [m]  "
          f"escaped of {runs}")
    for evader in EVADERS:
        for zeta_m, eta_m, gain_per_s, late, sure in SETTINGS:
            found = [run(evader, zeta_m, seed, sure=sure, latency_steps=late, eta_m=eta_m, gain_per_s=gain_per_s)
                     for seed in range(runs)]
            looks = np.array([one.looks for one in found])
            escaped = sum(one.escaped_ns is not None for one in found)
            bad = (sure and escaped > 0) or looks.mean() > MOST_LOOKS.get((evader, zeta_m, eta_m), np.inf)
            wrong += bad
            print(f"{evader:8s} {zeta_m:8.3f} {eta_m:8.2f} {gain_per_s:8.1f} {late:13d} "
                  f"{looks.mean():12.2f} {looks.max():5d} "
                  f"{min(one.least_m for one in found):19.3f} {escaped:11d}{'  WRONG' if bad else ''}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
