"""The omnidirectional robot: cut steps, limits, no lag. Against SciPy: test_models.py."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, sin
from random import Random

import numpy as np
import pytest

from fmus.description import PlantDescription
from fmus.plant import Plant

MS = 1_000_000
EPS = np.finfo(float).eps
Own = Callable[..., PlantDescription]
STATE = ("x", "y", "theta", "v_x", "v_y", "omega")


@pytest.mark.parametrize("seed", range(5))
def test_steps_cut_at_random_instants_end_where_one_step_does(seed: int, own: Own) -> None:
    rng = Random(f"{seed}/cuts")
    cuts = sorted({rng.randrange(1, 2_000 * MS) for _ in range(40)})
    start = {"tau_s": 0.2, "v_x": -0.5, "v_x_cmd": 1.0, "v_y_cmd": 0.3, "omega_cmd": -2.0}

    with Plant(own("omnidirectional"), "p", start) as whole, Plant(own("omnidirectional"), "q", start) as cut:
        whole.advance_to(2_000 * MS)
        for t_ns in [*cuts, 2_000 * MS]:
            cut.advance_to(t_ns)
        seen, expected = cut.output_group(STATE).read(), whole.output_group(STATE).read()

    assert seen == pytest.approx(expected, rel=0, abs=40 * 4 * 4 * EPS)      # 40 cuts, values up to 4


@pytest.mark.parametrize("direction_rad", [0.0, 0.4, 2.0, -3.0])
def test_the_limit_shortens_the_command_and_keeps_its_direction(direction_rad: float, version: str, own: Own) -> None:
    start = {"speed_max_mps": 0.3, "omega_max_radps": 1.5, "theta": 1.0, "v_x_cmd": 5 * cos(direction_rad),
             "v_y_cmd": 5 * sin(direction_rad), "omega_cmd": -9.0}

    with Plant(own("omnidirectional", version), "p", start) as plant:
        plant.advance_to(2_000 * MS)
        x, y, theta, v_x, v_y, omega = plant.output_group(STATE).read()

    assert (x, y) == pytest.approx((0.6 * cos(direction_rad), 0.6 * sin(direction_rad)), abs=1e-15)
    assert (hypot(v_x, v_y), omega, theta) == pytest.approx((0.3, -1.5, 1.0 - 3.0), rel=1e-15)


def test_without_a_lag_the_velocity_is_the_command_at_once_also_before_a_step(own: Own) -> None:
    with Plant(own("omnidirectional"), "p", {}) as plant:
        plant.input_group(["v_x_cmd", "v_y_cmd", "omega_cmd"]).write((0.25, -0.5, 2.0))

        assert plant.output_group(["v_x", "v_y", "omega"]).read() == (0.25, -0.5, 2.0)
