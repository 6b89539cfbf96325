"""Makes the tables of the policy `optimal` before a run: tau* by state for each planned value of the inputs.

The caps of tau* are, by `cap`:

    local       the exact local limit of the inputs, the same for every state: stability near 0 only, no certificate
    regional    the horizon (4.37) with gains found for the amplitudes of a region: 3.20, 4.91, 9.43 1/s
    printed     the horizon (4.37) with the gains of the team, which are the printed ones if it has none

Differs from the dissertation: with the printed gains the cap always binds, so its "[.6, .9] tau_max" cannot be had.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np

from agents.optimal_triggering.average_cost import solve_average_cost
from agents.optimal_triggering.averager import Grid, symmetric
from agents.optimal_triggering.decision_model import DecisionModel, tabulate
from agents.optimal_triggering.formulation import Formulation
from agents.optimal_triggering.held_loop import Floats, HeldLoop, Weights
from agents.optimal_triggering.local_limit import local_limit_s
from agents.optimal_triggering.lyapunov_shape import lyapunov_shape
from agents.optimal_triggering.noise_points import cubature
from agents.optimal_triggering.policy_iteration import iterate_policies
from agents.optimal_triggering.value_iteration import iterate_values
from agents.tracking.controller import Inputs
from agents.tracking.error_system import LIMITS, TrackingErrorSystem
from agents.tracking.optimal_settings import OptimalSettings
from agents.triggering.gain_table import GainTable
from agents.triggering.policies.input_output import IndividualGains

PRINTED_TOLERANCE_J: Final = 1e-5       # of a step of value iteration (F1); a look costs some 1e-4 J
REGIONAL: Final = GainTable({(0.6, 0.15): 3.20, (1.0, 1.0): 4.91, (2.0, 2.0): 9.43}, unified=9.43)


class Tables(NamedTuple):
    by_inputs: list[dict[str, Any]]     # inputs, axes, tau_s, cap_s, rate (cost per second that the model expects)
    values: list[Floats | None]         # V* or h at the grid's points, for charts; None if tau is not chosen by it
    remark: str                         # what a degenerate table is due to; "" if there is none


class Best(NamedTuple):
    tau_s: Floats                       # tau* at the grid's points
    rate: float                         # the cost per second that the model expects, 0 for a discounted cost
    at_points: Floats                   # V* or h


def make_tables(settings: OptimalSettings, gains: GainTable, look_cost_j: float,
                progress: Callable[[], None] = lambda: None) -> Tables:
    """Return the tables for all inputs of `gains`; ValueError if a cap is below the shortest interval."""
    made, found = [], []
    for row in gains.rows:
        table, at_points = make_table(settings, gains, Inputs(*row[:2]), look_cost_j, progress)
        made.append(table)
        found.append(at_points)
    return Tables(made, found, _remark(settings, made, look_cost_j))


def _remark(settings: OptimalSettings, made: list[dict[str, Any]], look_cost_j: float) -> str:
    shortest_s = settings.shortest_ms * 1e-3
    if settings.constant_ms:
        return f"constant_ms={settings.constant_ms:g}: the interval of every state, whatever a look costs"
    if all(tau <= shortest_s * (1 + 1e-9) for table in made for tau in table["tau_s"]):
        why = ("formulation=\"per_transmission\" discounts by looks, so S does not change which interval is best (F1)"
               if settings.formulation == "per_transmission" else "a look costs less than any waiting")
        return f"S = {look_cost_j:.3g} J makes every interval the shortest, {shortest_s:g} s: {why}"
    if all(tau >= cap * (1 - 1e-9) for table in made for tau, cap in zip(table["tau_s"], table["cap_s"], strict=True)):
        return (f"S = {look_cost_j:.3g} J makes every interval its cap (cap=\"{settings.cap}\"): the policy is that of "
                "the cap alone")
    return ""


def make_table(settings: OptimalSettings, gains: GainTable, inputs: Inputs, look_cost_j: float,
               progress: Callable[[], None] = lambda: None) -> tuple[dict[str, Any], Floats | None]:
    """Return the table for the inputs, and V* or h at the points of its grid."""
    at_points: Floats | None = None
    if settings.constant_ms:
        grid, cap_s = grid_and_caps(settings, gains, inputs)
        best_s, rate = np.clip(settings.constant_ms * 1e-3, settings.shortest_ms * 1e-3, cap_s), 0.0
    else:
        model, grid, cap_s = tabulated(settings, gains, inputs, progress)
        best_s, rate, at_points = best_intervals(settings, model, look_cost_j)
    progress()
    return {"inputs": list(inputs), "axes": [axis.tolist() for axis in grid.axes],
            "tau_s": _whole_us(best_s), "cap_s": _whole_us(cap_s),
            "shortest_s": settings.shortest_ms * 1e-3, "rate": rate}, at_points


def _whole_us(seconds: Floats) -> list[float]:
    """Return the times rounded down to whole microseconds, so that another machine's rounding changes no run."""
    return [float(us) / 1e6 for us in np.floor(seconds * 1e6 + 1e-3)]


def tabulated(settings: OptimalSettings, gains: GainTable, inputs: Inputs,
              progress: Callable[[], None] = lambda: None) -> tuple[DecisionModel, Grid, Floats]:
    """Return the decision problem on the grid of the settings, which S is not part of, and the caps there [s]."""
    loop = HeldLoop(inputs, Weights(settings.q_w_per_m2, settings.r_w_s2_per_m2), nodes=4)
    grid, cap_s = grid_and_caps(settings, gains, inputs)
    shortest_s = settings.shortest_ms * 1e-3
    progress()
    formulation = Formulation(settings.formulation)
    tau_s = shortest_s * (cap_s[:, None] / shortest_s) ** np.linspace(0, 1, settings.candidates)
    shape = lyapunov_shape(loop) if formulation is Formulation.AVERAGE_COST else None
    model = tabulate(loop, grid, tau_s, formulation, cubature(settings.measurement_noise, settings.disturbance),
                     shape=shape)
    progress()
    return model, grid, cap_s


def grid_and_caps(settings: OptimalSettings, gains: GainTable, inputs: Inputs) -> tuple[Grid, Floats]:
    """Return the grid of the settings and the caps at its points [s]; ValueError for a cap below the shortest one."""
    across = symmetric(*settings.x_m)
    grid = Grid(across, across, symmetric(*settings.heading_rad))
    cap_s = caps(settings, gains, HeldLoop(inputs), grid.points)
    _check_caps(settings, inputs, grid.points, cap_s)
    return grid, cap_s


def best_intervals(settings: OptimalSettings, model: DecisionModel, look_cost_j: float) -> Best:
    """Solve the problem of the settings' formulation."""
    formulation = Formulation(settings.formulation)
    if formulation is Formulation.AVERAGE_COST:
        average = solve_average_cost(model, look_cost_j)
        return Best(average.tau_s, average.rate, average.at_points)
    if formulation is Formulation.PER_SECOND:
        discounted = iterate_policies(model, look_cost_j, average=False)
        return Best(discounted.tau_s, 0.0, discounted.at_points)
    printed = iterate_values(model, look_cost_j, tolerance=PRINTED_TOLERANCE_J)
    return Best(printed.tau_s, 0.0, printed.at_points)


STEPS_PER_TABLE: Final = 3      # calls of `progress` for each table


def caps(settings: OptimalSettings, gains: GainTable, loop: HeldLoop, x: Floats) -> Floats:
    """Return the cap of tau* [s] at the states x of shape (3, n)."""
    if settings.cap == "local":
        return np.full(x.shape[1], local_limit_s(loop))
    trigger = IndividualGains(TrackingErrorSystem(limits=LIMITS, noise=settings.measurement_noise),
                              REGIONAL if settings.cap == "regional" else gains)
    return np.array([trigger.decide(0, (x1, x2, x3), loop.held).valid_ns * 1e-9 for x1, x2, x3 in x.T.tolist()])


def cap_problems(settings: OptimalSettings, gains: GainTable) -> list[str]:
    """Return the problems of the caps at the corners of the table, where horizons are least; quick."""
    corner = np.array([[settings.x_m[-1], settings.x_m[-1], settings.heading_rad[-1]]]).T
    signs = np.stack([each.ravel() for each in np.meshgrid(*[[-1.0, 1.0]] * 3)])
    found = []
    for row in gains.rows:
        loop = HeldLoop(Inputs(*row[:2]))
        try:
            _check_caps(settings, loop.held, corner * signs, caps(settings, gains, loop, corner * signs))
        except ValueError as error:
            found.append(str(error))
    return found


def _check_caps(settings: OptimalSettings, inputs: Inputs, x: Floats, cap_s: Floats) -> None:
    least = int(cap_s.argmin())
    if cap_s[least] < settings.shortest_ms * 1e-3:
        raise ValueError(f"team.optimal.shortest_ms={settings.shortest_ms:g}: the cap \"{settings.cap}\" is "
                         f"{cap_s[least] * 1e3:.3f} ms at x = ({', '.join(f'{value:g}' for value in x[:, least])}) "
                         f"with inputs ({inputs.v_mps:g}, {inputs.omega_rad_s:g}), expected no cap below the shortest "
                         "interval: lower shortest_ms, or make the table smaller (x_m)")


