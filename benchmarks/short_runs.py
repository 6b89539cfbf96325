"""Measures the processor time of a short inline run, many of them in one process, as in a sweep or a search.

    python -m benchmarks.short_runs [RUNS [SCENARIO [LENGTH_S]]]

The first runs import modules, build plants and fill caches; they are not counted.
"""

from __future__ import annotations

import resource
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from experiments.run.runner import run
from experiments.scenario import find, load

WARM_UP = 3


def main(runs: int = 40, name: str = "output_sync", length_s: float = 0.2) -> None:
    scenario = load(find(name), duration_s=length_s)
    used_s, hashes, after_mb = [], set(), []
    with TemporaryDirectory() as folder:
        for number in range(WARM_UP + runs):
            began_s = time.process_time()
            result = run(scenario, host="inline", out=Path(folder) / str(number), report=False)
            used_s.append(time.process_time() - began_s)
            hashes.add(result.summary.ledger_hash)
            after_mb.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    counted = used_s[WARM_UP:]
    print(f"{name}, {length_s:g} s, inline, {result.summary.code.split(':')[0]}, without a report, {runs} runs: median "
          f"{median(counted) * 1e3:.1f} ms of processor time, fastest {min(counted) * 1e3:.1f}, slowest "
          f"{max(counted) * 1e3:.1f}; {len(hashes)} hash: {min(hashes)}; "
          f"largest memory after the first of these {after_mb[WARM_UP]:.0f} MB, after the last {after_mb[-1]:.0f} MB")


if __name__ == "__main__":
    given = sys.argv[1:]
    main(*[kind(text) for kind, text in zip((int, str, float), given, strict=False)])
