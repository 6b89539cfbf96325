"""Draws what the policy `optimal` is made of: Figure 5.3, the value of a state, and tau*, over x1 and x2 at x3 = 0.

The value is shown on the whole grid, tau* on the inner half of its points, where a robot is once it follows. Between
the points both are interpolated linearly, as the robot does with tau*.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

import numpy as np

from agents.optimal_triggering.averager import Grid, values
from agents.optimal_triggering.formulation import Formulation
from agents.optimal_triggering.held_loop import Floats
from agents.tracking.optimal_settings import OptimalSettings
from agents.tracking.optimal_tables import Tables
from firmware_sim.height_chart import HeightChart

DIGITS: Final = 5
VALUES: Final = {Formulation.PER_TRANSMISSION: ("5.3 (F1), as printed", "V*"),
                 Formulation.PER_SECOND: ("5.3 (F2)", "V*"),
                 Formulation.AVERAGE_COST: ("5.3 (F3)", "h")}


def optimal_charts(settings: OptimalSettings, tables: Tables, look_cost_j: float) -> Iterator[HeightChart]:
    """Yield the value of a state and tau* for each value of the inputs; no value if `constant_ms` chooses tau."""
    number, symbol = VALUES[Formulation(settings.formulation)]
    for table, at_points in zip(tables.by_inputs, tables.values, strict=True):
        grid, tau_s = Grid(*map(np.array, table["axes"])), np.array(table["tau_s"])
        across, outer = grid.axes[0], grid.axes[0].size // 4
        inputs = f"inputs ({table['inputs'][0]:g} m/s, {table['inputs'][1]:g} rad/s)"
        if at_points is not None:
            rate = f"; cost {table['rate']:.4f} per second in the long run" if table["rate"] else ""
            yield over_x1_x2(f"Figure {number}: {symbol} at x3 = 0, {inputs}", f"S = {look_cost_j:.3g} J{rate}", symbol,
                             across, partial(values, grid, at_points))
        yield over_x1_x2(f"tau* near 0, x3 = 0, {inputs}", f"in the whole table {tau_s.min():.4g} to {tau_s.max():.4g} "
                         f"s; least cap {min(table['cap_s']):.4g} s", "tau* [s]", across[outer:-outer],
                         partial(values, grid, tau_s))


def over_x1_x2(title: str, note: str, unit: str, across: Floats, of: Callable[[Floats], Floats]) -> HeightChart:
    """Return the chart of a function of states of shape (3, n), for x1 and x2 `across` and x3 = 0."""
    x1, x2 = np.meshgrid(across, across)
    z = of(np.stack([x1.ravel(), x2.ravel(), np.zeros(x1.size)])).reshape(x1.shape)
    at = across.round(DIGITS).tolist()
    return HeightChart(title, note, "x1 [m]", "x2 [m]", unit, at, at, z.round(DIGITS).tolist())
