"""How `marconet break` compares with random search and psy-taliro: python -m benchmarks.search [--certified RUNS]

Two robots agree over slots (benchmarks/search_pair.toml); the budget is at most one loss in a row on each link. Printed
are the least robustness in 200 runs and the first run that violates the formula, for three seeds of the search.
`--certified 10000` searches that many runs with the slot length that is certified for this budget: none may violate it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from experiments.run.figures import Repeated
from experiments.search.base import Base
from experiments.search.budget import read_budget
from experiments.search.falsify import Making, Wanted, falsify
from experiments.search.loss_patterns import greedy
from experiments.search.objective import Objective
from experiments.search.strategy import Candidate, Evolution, RandomSearch

PAIR = Path(__file__).with_name("search_pair.toml")
BUDGET = "radio: * -> *: at most 1 lost in a row"
LINKS = (("radio", "r2", "r3"), ("radio", "r3", "r2"))
CERTIFIED_US, RUNS, SEEDS = 13_285, 200, (0, 1, 2)


def base_of(slot_us: int) -> Base:
    return Base.of(PAIR, overrides=(f"team.slot_us={slot_us}",))


def by_marconet(strategy: type[RandomSearch], slot_us: int, runs: int, seed: int, jobs: int | None = None
                ) -> list[float]:
    base = base_of(slot_us)
    with TemporaryDirectory() as folder:
        return falsify(Wanted(base, [BUDGET], Objective.of("agree", base), runs, seed=seed, jobs=jobs,
                              out=Path(folder), strategy=lambda space, total, own: _of(strategy, space, total, own))
                       ).costs


def _of(strategy, space, runs, seed):
    return Evolution(space, runs, seed) if strategy is Evolution else strategy(space, seed)


def by_taliro(optimizer: str, slot_us: int, runs: int, seed: int) -> list[float]:
    """One input in [0, 1] for each frame of a link: lost above 0.5, as far as the budget allows."""
    import staliro
    from staliro.optimizers import DualAnnealing, UniformRandom

    base = base_of(slot_us)
    budget = read_budget([BUDGET], {"radio": ("r2", "r3")}, {})
    making = Making(base, budget, Objective.of("agree", base), ())
    frames = int(base.scenario.length_ns / (2 * slot_us * 1000)) + 1
    making.frames = dict.fromkeys(LINKS, frames)
    costs: list[float] = []

    @staliro.costfunc
    def cost(inputs: staliro.Inputs) -> float:
        values = inputs.sample.values
        losses = tuple((link, greedy([n for n in range(frames) if values[k * frames + n] > 0.5], budget.losses[link]))
                       for k, link in enumerate(LINKS))
        candidate = Candidate(tuple(entry for entry in losses if entry[1]))
        figures = Repeated(partial(base.source.load, making.values(candidate)), "inline").run(base.scenario.seed)
        costs.append(making.objective.cost(figures))
        return costs[-1]

    options = staliro.TestOptions(static_inputs={f"x{n}": (0.0, 1.0) for n in range(2 * frames)}, iterations=runs,
                                  seed=seed + 1)
    staliro.staliro(cost, {"uniform": UniformRandom, "annealing": DualAnnealing}[optimizer](), options)
    return costs[:runs]


def told(name: str, found: Sequence[Sequence[float]]) -> str:
    firsts = [next((str(number + 1) for number, cost in enumerate(costs) if cost < 0), "none") for costs in found]
    return f"{name:24s} least {', '.join(f'{min(costs):.3g}' for costs in found):28s} first in run {', '.join(firsts)}"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--certified", type=int, default=0, metavar="RUNS")
    parser.add_argument("--jobs", type=int)
    given = parser.parse_args()
    if given.certified:
        start_s = time.monotonic()
        costs = by_marconet(Evolution, CERTIFIED_US, given.certified, 0, given.jobs)
        print(f"slots of {CERTIFIED_US} us: least robustness {min(costs):.6g} in {len(costs)} runs, "
              f"{sum(cost < 0 for cost in costs)} violate; {time.monotonic() - start_s:.0f} s")
        return
    for slot_us in (45_000, 25_000):
        print(f"slots of {slot_us} us, {RUNS} runs")
        for name, strategy in (("marconet break", Evolution), ("random", RandomSearch)):
            print(told(name, [by_marconet(strategy, slot_us, RUNS, seed, given.jobs) for seed in SEEDS]), flush=True)
        try:
            for optimizer in ("uniform", "annealing"):
                print(told(f"psy-taliro, {optimizer}", [by_taliro(optimizer, slot_us, RUNS, seed) for seed in SEEDS]),
                      flush=True)
        except ImportError:
            print("psy-taliro is not installed: pip install -e '.[peers]'")


if __name__ == "__main__":
    main()
