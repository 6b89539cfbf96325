"""Tables 5.1 to 5.4 of our numbering: what Chapter 5 prints as sentences, computed, and the three formulations.

An entry is a row with its name on the page of reproductions and the function that measures it. `runs` counts the
rollouts of a row with a mean; the other rows are computed once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from agents.optimal_triggering.averager import Averager
from agents.optimal_triggering.online import Stopped
from agents.optimal_triggering.rollouts import Mean
from agents.optimal_triggering.value_iteration import Solution
from agents.tracking import section_5_3 as case
from agents.tracking.controller import Inputs
from experiments.show.tables import Measured, Row

Measure = Callable[[int], float | Mean]


class Entry(NamedTuple):
    name: str               # of the row of docs/reproduction.md
    row: Row
    measure: Measure        # of the number of rollouts
    digits: int


class Entries:
    """A table of entries."""

    def __init__(self, title: str, judged_by: str, entries: list[Entry], runs: int = case.RUNS) -> None:
        self.title, self.judged_by, self.entries, self.runs = title, judged_by, entries, runs

    def steps(self, runs: int) -> int:
        return len(self.entries)

    def measure(self, runs: int, progress: Callable[[], None]) -> Iterator[Measured]:
        for entry in self.entries:
            found = entry.measure(runs)
            progress()
            if isinstance(found, Mean):
                yield Measured(entry.row, found.mean, found.variance, found.runs)
            else:
                yield Measured(entry.row, found, None, 1)


def _about(value: float, share: float) -> tuple[float, float]:
    return value * (1 - share), value * (1 + share)


# --- 5.1: the intervals that the print starts from

STATES = ((0.0, 0.0, 0.0), (1.0, 1.0, 0.5), (5.0, 5.0, 1.0), (10.0, -10.0, 1.5), (30.0, 30.0, 3.0))
AT_STATES_MS = (18.405, 18.234, 16.582, 15.021, 11.206)


def _tau_max(x: tuple[float, ...], held: Inputs = case.HELD) -> Measure:
    return lambda runs: float(case.tau_max(np.array(x)[:, None], held)[0]) * 1e3


def _cost(x: tuple[float, ...]) -> Measure:
    def measured(runs: int) -> float:
        at = np.array(x)[:, None]
        return float(case.LOOP.cost(at, case.LOOP.command(at), case.LOOP.inputs(), case.tau_max(at))[0])
    return measured


def _row(name: str, what: str, quantity: str, unit: str, band: tuple[float | None, float | None], measure: Measure,
         digits: int, printed: float | None = None) -> Entry:
    return Entry(name, Row(what, quantity, unit, printed, None, *band), measure, digits)


CAPS = [
    *(_row(f"tau-max-{k}", f"x = ({', '.join(f'{each:g}' for each in x)})", "tau_max", "ms", _about(ms, 0.01),
           _tau_max(x), 2) for k, (x, ms) in enumerate(zip(STATES, AT_STATES_MS, strict=True))),
    _row("tau-max-slow", "x = 0, inputs (0.6, 0.15)", "tau_max", "ms", _about(43.434, 0.01),
         _tau_max(STATES[0], Inputs(0.6, 0.15)), 2),
    _row("tau-max-fast", "x = 0, inputs (2, 2)", "tau_max", "ms", _about(17.221, 0.01),
         _tau_max(STATES[0], Inputs(2.0, 2.0)), 2),
    _row("cost-0", "one tau_max at 0", "running cost", "1", _about(0.0037, 0.02), _cost(STATES[0]), 5),
    _row("cost-5", "one tau_max at (5, 5, 1)", "running cost", "1", _about(0.275, 0.02), _cost(STATES[2]), 4)]

# --- 5.2: F1 as printed


@cache
def _f1(averager: Callable[[], Averager], start: float) -> Solution:
    return case.printed_solution(case.printed_problem(averager()), start)


def _f1_value(averager: Callable[[], Averager], start: float) -> Measure:
    return lambda runs: float(np.abs(_f1(averager, start).at_points - 375).max())


def _f1_starts(runs: int) -> float:
    one, other = (_f1(case.coarse_grid, start).at_points for start in (0.0, 500.0))
    return float(np.abs(one - other).max())


@cache
def _stops() -> list[Stopped]:
    return [case.printed_perceptron(*each) for each in STOPS]


STOPS = tuple((seed, level) for seed in (0, 1) for level in (0.0, 500.0))


def _stopped(part: Callable[[list[Stopped]], float]) -> Measure:
    return lambda runs: part(_stops())


F1 = [
    _row("f1-grid", "grid, largest |V* - 375|", "V*", "1", (None, 0.05), _f1_value(case.coarse_grid, 0.0), 3),
    _row("f1-neighbours", "4 nearest neighbours, largest |V* - 375|", "V*", "1", (None, 0.05),
         _f1_value(case.neighbours, 500.0), 3),
    _row("f1-interval", "largest tau* of all states", "tau*", "s", (0.0, 0.0),
         lambda runs: float(_f1(case.coarse_grid, 0.0).tau_s.max()), 1),
    _row("f1-contraction", "ratio of successive steps", "contraction", "1", (0.959, 0.961),
         lambda runs: float(_f1(case.coarse_grid, 0.0).contractions.max()), 3),
    _row("f1-starts", "two starts V0, largest difference", "V*", "1", (None, 0.05), _f1_starts, 3),
    _row("f1-independent", "J(S = 15) - J(S = 0)", "cost", "1", (375 - 1e-4, 375 + 1e-4),
         lambda runs: case.printed_rollout(1.0) - case.printed_rollout(1.0, 0.0), 4),
    *(_row(f"f1-rollout-{share:g}", f"J - 375 from (5, 5, 1), tau = {share:g} tau_max", "cost", "1",
           (J - 0.05, J + 0.05), lambda runs, share=share: case.printed_rollout(share) - 375, 2)  # type: ignore[misc]
      for share, J in ((0.1, 0.69), (0.6, 2.97), (1.0, 3.93))),
    _row("f1-stop-least", "perceptron: stop rule ends after at least", "steps", "1", (100.0, 299.0),
         _stopped(lambda found: min(each.steps for each in found)), 0, 300.0),
    _row("f1-stop-most", "perceptron: and at most", "steps", "1", (100.0, 299.0),
         _stopped(lambda found: max(each.steps for each in found)), 0, 400.0),
    _row("f1-stop-residual", "perceptron: true Bellman residual then, at most", "residual", "1", (None, None),
         _stopped(lambda found: max(each.residual for each in found)), 1),
    _row("f1-stop-low", "perceptron: least V then", "V", "1", (None, None),
         _stopped(lambda found: min(each.low for each in found)), 0),
    _row("f1-stop-high", "perceptron: largest V then", "V", "1", (None, None),
         _stopped(lambda found: max(each.high for each in found)), 0)]

# --- 5.3: F2, weights per second

SHARES = (0.1, 0.5, 0.75, 0.9, 1.0)


def _f2_share(runs: int) -> float:
    solution, model = case.per_second(case.S, *SHARES)
    near = np.linalg.norm(model.averager.points, axis=0) < 15
    return float((solution.tau_s / model.tau_s[:, -1])[near].min())


F2 = [
    _row("f2-value", "S = 15", "V(0)", "1", _about(20047, 0.002),
         lambda runs: case.value_at_rest(case.per_second(case.S, *SHARES)[0]), 0),
    _row("f2-share", "least tau* / tau_max, |x| < 15", "share", "1", (1.0, 1.0), _f2_share, 2, 0.6),
    _row("f2-iterations", "policy iteration", "steps", "1", (4.0, 8.0),
         lambda runs: float(case.per_second(case.S, *SHARES)[0].iterations), 0),
    _row("f2-dearer", "0.75 tau_max for ever, dearer by", "V(0)", "%", (31.0, 34.0), lambda runs: 100 * (
        case.value_at_rest(case.per_second(case.S, 0.75)[0])
        / case.value_at_rest(case.per_second(case.S, 1.0)[0]) - 1), 1)]

# --- 5.4: F3, the long-run mean

RATES = {0.01: 0.2039, 0.05: 0.2040, 0.2: 0.2054, 0.4: 0.2081, 0.8: 0.2167}
BEST = {0.015: 0.8, 0.005: 0.6, 0.0015: 0.4, 0.0005: 0.2}
FAR_CONSTANTS = (0.05, 0.1, 0.15, 0.2, 0.3)


def _rate(tau_s: float) -> Measure:
    return lambda runs: case.constant_runs(tau_s, False, runs).rate(0.0)


def _learned(look_cost: float) -> Measure:
    return lambda runs: case.runs_of(case.learned(look_cost).policy, runs=runs).rate(look_cost)


def _dearer(look_cost: float, far: bool) -> Measure:
    def measured(runs: int) -> float:
        policy = case.learned(look_cost).policy
        own = case.runs_of(policy, case.FAR, 12.0, runs) if far else case.runs_of(policy, runs=runs)
        best, _ = case.best_constant(look_cost, far, FAR_CONSTANTS if far else case.CONSTANTS)
        return 100 * (own.rate(look_cost).mean / best - 1)
    return measured


F3 = [
    *(_row(f"f3-constant-{tau:g}", f"constant {tau:g} s, S = 0", "cost per s", "1", (rate - 0.001, rate + 0.001),
           _rate(tau), 4) for tau, rate in RATES.items()),
    *(_row(f"f3-best-{S:g}", f"best constant interval, S = {S:g}", "tau", "s", (tau - 0.01, tau + 0.01),
           lambda runs, S=S: case.best_constant(S)[1], 1) for S, tau in BEST.items()),         # type: ignore[misc]
    *(_row(f"f3-learned-{S:g}", f"learned policy, S = {S:g}", "cost per s", "1", (None, None), _learned(S), 4)
      for S in BEST),
    *(_row(f"f3-dearer-{S:g}", f"the same, dearer than the best constant interval, S = {S:g}", "cost per s", "%",
           (None, 1.0), _dearer(S, False), 1) for S in BEST),
    *(_row(f"f3-far-{S:g}", f"from (5, 5, 1) over 12 s, dearer than the best constant, S = {S:g}", "cost per s", "%",
           (None, 0.0), _dearer(S, True), 1) for S in BEST)]
