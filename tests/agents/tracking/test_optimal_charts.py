"""Charts of the optimal policy: the value and tau* of the tables that the robots have."""

import numpy as np
import pytest

from agents.optimal_triggering.averager import Grid
from agents.tracking.optimal_charts import optimal_charts, over_x1_x2
from agents.tracking.optimal_settings import OptimalSettings
from agents.tracking.optimal_tables import make_tables
from agents.tracking.section_4_6 import GAINS

GRID = {"x_m": (0.2, 0.8, 3.0, 8.0), "heading_rad": (0.4, 3.14), "candidates": 8}


def charts(**settings):
    chosen = OptimalSettings(**GRID, **settings)
    made = make_tables(chosen, GAINS, 1.5e-3)
    return list(optimal_charts(chosen, made, 1.5e-3)), made


def test_each_value_of_the_inputs_has_its_value_function_and_its_intervals():
    drawn, made = charts()

    assert [chart.title.partition(",")[0] for chart in drawn] == ["Figure 5.3 (F3): h at x3 = 0", "tau* near 0"] * 3
    assert drawn[2].title.endswith("inputs (1 m/s, 1 rad/s)")
    at_x3_0 = made.values[1].reshape(9, 9, 5)[:, :, 2]
    assert drawn[2].x == drawn[2].y == [-8.0, -3.0, -0.8, -0.2, 0.0, 0.2, 0.8, 3.0, 8.0]
    assert pytest.approx(at_x3_0, abs=1e-5) == np.array(drawn[2].z).T        # a row for each x2
    assert drawn[3].x == [-0.8, -0.2, 0.0, 0.2, 0.8]
    tau_s = np.array(made.by_inputs[1]["tau_s"]).reshape(9, 9, 5)[2:7, 2:7, 2]
    assert pytest.approx(tau_s, abs=1e-5) == np.array(drawn[3].z).T


def test_as_printed_the_value_is_that_of_looks_alone_where_nothing_else_costs():
    drawn, _ = charts(formulation="per_transmission", q_w_per_m2=1e-9, r_w_s2_per_m2=1e-9)

    assert drawn[0].title.startswith("Figure 5.3 (F1), as printed: V* at x3 = 0")
    stop_rule, rounding = 1e-5 * 0.96 / (1 - 0.96), 1e-5
    assert np.array(drawn[0].z) == pytest.approx(1.5e-3 / (1 - 0.96), abs=stop_rule + rounding)


def test_a_constant_interval_has_no_value_to_draw():
    drawn, made = charts(constant_ms=100.0)

    assert made.values == [None] * 3
    assert [chart.title[:4] for chart in drawn] == ["tau*"] * 3
    assert {height for row in drawn[0].z for height in row} == {0.1}


def test_a_row_of_the_chart_is_one_x2():
    grid = Grid(np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.array([0.0, 1.0]))

    drawn = over_x1_x2("", "", "", grid.axes[0], lambda x: x[0] + 10 * x[1] + 100 * x[2])

    assert drawn.z == [[0.0, 1.0], [10.0, 11.0]]
