"""Whether one kind of pursuit captures more targets than another, over games with the same seeds.

    marconet sweep marco_polo --seed 1000 --seeds 300 --out PLAIN
    marconet sweep marco_polo_adaptive --seed 1000 --seeds 300 --out ADAPTIVE
    python -m benchmarks.marco_polo_captures PLAIN ADAPTIVE

A seed has the same targets, with the same ways, in both games, so games are compared in pairs: sign test, exact, one
side, over the seeds whose numbers of captures differ. The test of unpaired games, Fisher's, takes the targets of a game
for independent of each other and does not use that both scenarios meet the same ones. Intervals: Clopper and Pearson.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pyarrow.parquet as pq
from scipy.stats import binomtest, fisher_exact

from experiments.judge.campaign_statistics import Estimate, share

CAPTURED, ENTERED = "count.target_*.captured", "count.target_*.entered"
FIGURES = ("count.*.pursuits", "count.*.pursuits without a capture", "count.*.looks in pursuit",
           "count.*.pursuits failed: left S", "count.*.pursuits failed: lost link", "count.*.pursuits failed: other",
           "count.*.sights of targets that had left")


def main(plain: str, adaptive: str) -> None:
    captures, totals = [], []
    for folder in (plain, adaptive):
        rows = pq.read_table(Path(folder) / "runs.parquet").to_pylist()
        captured = {row["seed"]: int(row[CAPTURED]) for row in rows}
        total, entered = sum(captured.values()), sum(int(row[ENTERED]) for row in rows)
        some = sum(found > 0 for found in captured.values())
        captures.append(captured)
        totals.append((total, entered))
        print(f"{folder}: {total} of {entered} targets captured, {_shown(share(total, entered))}; a capture in {some} "
              f"of {len(rows)} games, {_shown(share(some, len(rows)))}; {sum(not row['holds'] for row in rows)} do not "
              "hold")
        for figure in FIGURES:
            if figure in rows[0]:
                print(f"  {figure}: {sum(row[figure] for row in rows):g}")
    seeds = captures[0].keys() & captures[1].keys()
    more = sum(captures[1][seed] > captures[0][seed] for seed in seeds)
    fewer = sum(captures[1][seed] < captures[0][seed] for seed in seeds)
    paired = binomtest(more, max(1, more + fewer), 0.5, alternative="greater").pvalue
    (few, all_few), (many, all_many) = totals
    unpaired = fisher_exact([[many, all_many - many], [few, all_few - few]], alternative="greater").pvalue
    print(f"of {len(seeds)} seeds {more} have more captures in {adaptive} and {fewer} fewer: sign test p = "
          f"{paired:.2g}, unpaired p = {unpaired:.2g}")


def _shown(found: Estimate) -> str:
    return f"{found.value:.1%} [{found.low:.1%}, {found.high:.1%}]"


if __name__ == "__main__":
    main(*sys.argv[1:])
