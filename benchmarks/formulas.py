"""How long the robustness of a formula takes, from signals in memory, beside rtamt: python -m benchmarks.formulas"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from experiments.judge.formula.robustness import robustness
from experiments.judge.frame_copies import FrameCopies
from experiments.judge.run_data import RunData
from netem.records.signal_table import SignalTable

STEP_NS = 10_000_000
FORMULA = "always(r.x > 0 implies eventually[0, 0.5 s] abs(r.y) < 1)"


def run(samples: int) -> RunData:
    values = np.cumsum(np.random.default_rng(1).normal(size=(samples, 2)), axis=0)
    table = SignalTable("r", ("x", "y"), ("1", "1"), np.arange(samples) * STEP_NS, values)
    return RunData(samples * STEP_NS, FrameCopies.of_rows([]), {"r": table})


def fastest_ms(call: Callable[[], object], times: int = 5) -> float:
    found = []
    for _ in range(times):
        start_s = time.perf_counter()
        call()
        found.append(time.perf_counter() - start_s)
    return min(found) * 1e3


def by_rtamt(data: RunData) -> float:
    import rtamt

    oracle = rtamt.StlDiscreteTimeSpecification()
    for name in ("x", "y"):
        oracle.declare_var(name, "float")
    oracle.spec = "always((x > 0) implies (eventually[0,50] (abs(y) < 1)))"
    oracle.parse()
    table = data.signals["r"]
    columns = {name: table.column(name).tolist() for name in ("x", "y")} | {"time": list(range(table.time_ns.size))}
    return fastest_ms(lambda: oracle.evaluate(columns), 3)


def main() -> None:
    for samples in (1_300, 10_000, 100_000):
        print(f"{samples} samples: {fastest_ms(partial(robustness, run(samples), FORMULA)):.1f} ms")
    try:
        print(f"1300 samples by rtamt: {by_rtamt(run(1_300)):.1f} ms")
    except ImportError:
        print("rtamt is not installed: pip install -e '.[oracles]'")


if __name__ == "__main__":
    main()
