"""Compares variants of the circle filter on Tables 3.1 and 3.3: RMSE [m], and the share of corrections kept by rho.

Then prints that share for the adaptive filter of Tables 3.2 and 3.4 with several rho.

    python -m benchmarks.circle_filter_variants [--runs 100]

The printed filter always takes a circle and a `line` of speeds; the tables have the line gate and the `mean` speed.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial

import numpy as np

from agents.estimation import Estimator, Inputs
from agents.estimation.circle_filter import CircleFilter
from agents.estimation.monte_carlo import Build, circle, errors_m
from agents.estimation.motions import MOTIONS
from agents.estimation.paths import INSTANTS, PATHS, STEP_NS
from agents.pursuit.chase import chase
from agents.pursuit.evaders import OnPath
from agents.pursuit.sampling import FIRST_LOOKS
from agents.pursuit.section_3_3 import SIGMA_M, TABLE_ZETA_M, pursuer

CELLS = [("circle", 786), ("circle", 100), ("circle", 31), ("circle", 22), ("circle", 17),
         ("zig-zag", 786), ("zig-zag", 100), ("zig-zag", 25), ("zig-zag", 20)]
GAMMA = {"circle": 17, "zig-zag": 3}
VARIANTS: dict[str, Callable[[int], Build]] = {
    "as printed": lambda window: circle(window, motion="line", line_gate=False),
    "no gate": lambda window: circle(window, line_gate=False),
    **{name: partial(circle, motion=name) for name in MOTIONS},
    "rho = 0.3 m": lambda window: circle(window, rho_m=0.3),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    runs = parser.parse_args().runs
    print("path     detections  " + "  ".join(f"{name:>15s}" for name in VARIANTS))
    for path, detections in CELLS:
        shown = []
        for variant in VARIANTS.values():
            built: list[CircleFilter] = []

            def build(start: tuple[float, float, float], inputs: Inputs, rng: np.random.Generator,
                      make: Build = variant(GAMMA[path]), built: list[CircleFilter] = built) -> Estimator:
                made = make(start, inputs, rng)
                assert isinstance(made, CircleFilter)
                built.append(made)
                return made

            error = errors_m(build, PATHS[path](), detections, runs, first=FIRST_LOOKS).mean()
            kept = sum(one.kept for one in built) / sum(one.kept + one.refitted for one in built)
            shown.append(f"{error:8.4f} {kept:5.0%} ")
        print(f"{path:8s} {detections:10d}  " + "  ".join(shown), flush=True)
    for path in PATHS:
        print(f"{path:8s}   adaptive  " + ", ".join(f"rho = {rho_m} m: {adaptive_share(path, rho_m, runs):.0%}"
                                                      for rho_m in (0.1, 0.2, 0.3)), flush=True)


def adaptive_share(path: str, rho_m: float, runs: int) -> float:
    kept = corrections = 0
    for seed in range(runs):
        hunter, evader = pursuer(path, TABLE_ZETA_M, sure=False, rho_m=rho_m), OnPath(PATHS[path]())
        chase(hunter, evader.place, evader, np.random.default_rng((0, seed)), instants=INSTANTS, step_ns=STEP_NS,
              sigma_m=SIGMA_M)
        assert isinstance(hunter.estimator, CircleFilter)
        kept += hunter.estimator.kept
        corrections += hunter.estimator.kept + hunter.estimator.refitted
    return kept / corrections


if __name__ == "__main__":
    main()
