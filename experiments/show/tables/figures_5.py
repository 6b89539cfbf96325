"""Figures 5.3 and 5.4 on one page that opens without a network: value functions, and a run of 12 s.

5.3 shows V*(x1, x2) at x3 = 0 for inputs (1, 1): as printed, where V* = S / (1 - gamma) for every state, and the
relative value h of the long-run mean. 5.4 shows the run of section 5.3 in the pure loop with the policy `optimal`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np

from agents.optimal_triggering.average_cost import solve_average_cost
from agents.optimal_triggering.averager import values
from agents.optimal_triggering.held_loop import Floats
from agents.tracking import section_5_3 as case
from agents.tracking.closed_loop import Run, run
from agents.tracking.error_system import LIMITS, TrackingErrorSystem
from agents.tracking.noise import Noise
from agents.tracking.optimal_charts import over_x1_x2
from agents.tracking.optimal_settings import OptimalSettings
from agents.tracking.optimal_tables import make_tables, tabulated
from agents.tracking.section_4_6 import GAINS, LENGTH_NS, START
from agents.triggering.policies.interval_table import IntervalTable
from agents.triggering.policies.table import PolicySettings, build_policy
from experiments.show.tables.figures import DIGITS, Json, render
from firmware_sim.height_chart import HeightChart
from netem.core.random_streams import stream

LOOK_COST = 0.0015
DETAIL_S = (1.5, 3.0)
STEPS = 12
ACROSS = 61                     # points of each axis of a value function
ABOUT = ("Figures 5.3 and 5.4", "When it pays to look: value functions of a tracking robot, and a run.",
         "Figure 5.3 as printed is a plane: (5.5) discounts by looks, so V* = S / (1 - gamma) for every state.")


def write_figures(path: Path, progress: Callable[[], None]) -> Path:
    path.write_text(render(figures(progress), ABOUT), encoding="utf-8")
    return path


def figures(progress: Callable[[], None]) -> list[Json]:
    printed = _printed_value(progress)
    relative = _relative_value(progress)
    run_of = section_5_3_run(progress)
    return [printed, relative, *_run_figures(run_of)]


def section_5_3_run(progress: Callable[[], None] = lambda: None) -> Run:
    """Run section 5.3 in the pure loop, with the tables of the policy `optimal` for S = LOOK_COST."""
    tables = {tuple(each["inputs"]): IntervalTable(each["axes"], each["tau_s"], each["cap_s"], each["shortest_s"])
              for each in make_tables(OptimalSettings(), GAINS, LOOK_COST, progress).by_inputs}
    policy = build_policy("optimal", TrackingErrorSystem(limits=LIMITS), GAINS, PolicySettings(tables=tables))
    noise = Noise(stream(1, "tracking/measuring"), stream(1, "tracking/driving"))
    return run(policy, case.REFERENCE, START, LENGTH_NS, noise=noise)


def _printed_value(progress: Callable[[], None]) -> Json:
    model = case.printed_problem(case.coarse_grid())
    solution = case.printed_solution(model, 0.0)
    progress()
    note = (f"V* from {solution.at_points.min():.2f} to {solution.at_points.max():.2f}: the same for every state; the "
            "best interval is 0")
    return _heights("5.3", over_x1_x2("V* as printed (F1), x3 = 0", note, "V*", np.linspace(-70.0, 70.0, ACROSS),
                                      lambda x: values(model.averager, solution.at_points, x)))


def _relative_value(progress: Callable[[], None]) -> Json:
    model, grid, _ = tabulated(OptimalSettings(), GAINS, case.HELD, progress)
    solution = solve_average_cost(model, LOOK_COST)
    note = f"cost per second {solution.rate:.4f}, tau* at 0: {solution.tau_s[solution.tau_s.size // 2]:.3f} s"
    return _heights("5.3 (F3)", over_x1_x2(f"h of the long-run mean, S = {LOOK_COST:g}, x3 = 0", note, "h",
                                           np.linspace(-15.0, 15.0, ACROSS),
                                           lambda x: values(grid, solution.at_points, x)))


def _heights(number: str, chart: HeightChart) -> Json:
    return {"kind": "heights", "number": number, **msgspec.to_builtins(chart)}


def _run_figures(done: Run) -> list[Json]:
    t_s = np.array([sample.t_ns for sample in done.samples]) * 1e-9
    x, e = (np.array([getattr(sample, name) for sample in done.samples]) for name in ("x", "e"))
    at_s = np.array([sent.t_ns for sent in done.transmissions]) * 1e-9
    tau_s = np.array([sent.decision.interval_ns for sent in done.transmissions]) * 1e-9
    changes = [change * 1e-9 for change in case.REFERENCE.changes_ns]
    inside = (at_s >= DETAIL_S[0]) & (at_s < DETAIL_S[1])
    note = f"{len(at_s)} looks, S = {LOOK_COST:g}, cap: the exact local limit"
    return [
        _lines("5.4 (a)", "State x of the tracking system", note, "m, m, rad", changes,
               [(f"x{k + 1}", "lines", t_s, x[:, k]) for k in range(3)]),
        _lines("5.4 (b)", "Norm of (x, e)", note, "1", changes,
               [("|(x, e)|", "lines", t_s, np.sqrt((x ** 2).sum(axis=1) + (e ** 2).sum(axis=1)))]),
        _lines("5.4 (c)", "Interval tau between two looks", note, "s", changes, [("tau", "markers", at_s, tau_s)]),
        _lines("5.4 (d)", "A detail of (c)", note, "s", [each for each in changes if DETAIL_S[0] <= each < DETAIL_S[1]],
               [("tau", "lines+markers", at_s[inside], tau_s[inside])])]


def _lines(number: str, title: str, note: str, unit: str, changes_s: list[float],
           lines: list[tuple[str, str, Floats, Floats]]) -> Json:
    return {"kind": "lines", "number": number, "title": title, "note": note, "unit": unit, "changes_s": changes_s,
            "lines": [{"name": name, "mode": mode, "x": _rounded(x), "y": _rounded(y)} for name, mode, x, y in lines]}


def _rounded(numbers: Floats) -> list[float]:
    return [round(number, DIGITS) for number in numbers.tolist()]
