"""Does a target escape? Looks and least true distance to the field of view's boundary, over many chases.

    python -m benchmarks.no_escape [--runs 1000]

Evaders: the circular path, the zig-zag, one that runs for the boundary. Escape areas: one that is sure (0.55 m, and
with answers 3 steps late 0.70 m), that of Tables 3.2 and 3.4 (0.45 m), the printed 3 T_s v_max (0.147 m). Exits with 1
if one escapes where it may not, or if Tables 3.2 and 3.4 take more looks than they may.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from agents.estimation.paths import STEP_NS
from agents.pursuit.section_3_3 import EVADERS, PRINTED_ZETA_M, SURE_ZETA_M, TABLE_ZETA_M, V_MAX_MPS, run

LATE_STEPS = 3
LATE_ZETA_M = SURE_ZETA_M + LATE_STEPS * STEP_NS * 1e-9 * V_MAX_MPS
# escape area, steps that answers are late, whether no target may escape
SETTINGS = ((SURE_ZETA_M, 0, True), (LATE_ZETA_M, LATE_STEPS, True), (TABLE_ZETA_M, 0, False),
            (PRINTED_ZETA_M, 0, False))
MOST_LOOKS = {("circle", TABLE_ZETA_M): 22.6 + 0.6, ("zig-zag", TABLE_ZETA_M): 29.2 + 1.0}      # means


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    runs = parser.parse_args().runs
    wrong = 0
    print(f"evader   zeta [m]  late [steps]  looks: mean  most  least distance [m]  escaped of {runs}")
    for evader in EVADERS:
        for zeta_m, late, sure in SETTINGS:
            found = [run(evader, zeta_m, seed, sure=sure, latency_steps=late) for seed in range(runs)]
            looks = np.array([one.looks for one in found])
            escaped = sum(one.escaped_ns is not None for one in found)
            bad = (sure and escaped > 0) or looks.mean() > MOST_LOOKS.get((evader, zeta_m), np.inf)
            wrong += bad
            print(f"{evader:8s} {zeta_m:8.3f} {late:13d} {looks.mean():12.2f} {looks.max():5d} "
                  f"{min(one.least_m for one in found):19.3f} {escaped:11d}{'  WRONG' if bad else ''}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
