"""The default gains on the linearized loop: a second check that does not fly anything."""

from __future__ import annotations

import numpy as np

from firmware_sim.autopilot.flight_loops import LAG_S
from firmware_sim.autopilot.parameters import TABLE

OMEGA = np.logspace(-2, 3, 200_001)
S = 1j * OMEGA
DELAY_S = 0.006         # half a navigation period and an execution time


def gain(name: str) -> float:
    return TABLE[name].default


def margins(loop: np.ndarray) -> tuple[float, float]:
    """Phase margin in degrees at the last crossing of 1, and the peak of the sensitivity."""
    size = np.abs(loop)
    last = np.nonzero((size[:-1] > 1) & (size[1:] <= 1))[0][-1]
    return 180 + float(np.degrees(np.angle(loop[last]))), float(np.max(1 / np.abs(1 + loop)))


def attitude(lag_s: float) -> np.ndarray:
    """From a target to the attitude: PD on a double integrator behind the motors' lag."""
    k_angle, k_rate = gain("ATT_KP"), gain("ATT_KD")
    return np.asarray(k_angle / (lag_s * S**3 + S**2 + k_rate * S + k_angle))


def test_the_attitude_loop_is_well_damped_also_with_motors_twice_as_slow() -> None:
    pd = gain("ATT_KD") * S + gain("ATT_KP")
    designed, slow = (margins(pd / (S**2 * (1 + lag_s * S)) * np.exp(-0.0012 * S))[0] for lag_s in (LAG_S, 2 * LAG_S))

    assert round(designed) == 49
    assert slow > 30


def test_the_horizontal_loop_has_the_margins_that_its_page_names() -> None:
    pid = gain("POS_KD") * S + gain("POS_KP") + gain("POS_KI") / S

    phase_deg, sensitivity = margins(pid * attitude(LAG_S) / S**2 * np.exp(-DELAY_S * S))

    assert round(phase_deg) == 49
    assert round(sensitivity, 2) == 1.47


def test_the_vertical_loop_has_at_least_the_horizontal_ones_margin() -> None:
    pid = gain("ALT_KD") * S + gain("ALT_KP") + gain("ALT_KI") / S

    phase_deg, sensitivity = margins(pid / (1 + LAG_S * S) / S**2 * np.exp(-DELAY_S * S))

    assert phase_deg > 49
    assert sensitivity < 1.47
