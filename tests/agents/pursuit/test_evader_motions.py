"""How evaders are driven: the paths of section 3.3.1 again, and what the others promise."""

from math import atan2, cos, hypot, pi, remainder, sin
from random import Random

import numpy as np
import pytest

from agents.estimation.paths import INSTANTS, PATHS, STEP_NS
from agents.pursuit.evader_motions import MOTIONS, Driver
from agents.pursuit.law import Area
from agents.tracking.controller import Pose

AREA = Area((-2.0, 2.0), (-1.0, 1.0))


def driver(v_max_mps=0.7, seed=1):
    return Driver(v_max_mps, AREA, Random(seed))


def driven(motion, instants=INSTANTS, pursuer=None, parts=10):
    """A unicycle without lag, commands held for T_s."""
    pose, poses = Pose(0.0, 0.0, 0.0), []
    for k in range(instants):
        poses.append(pose)
        v, omega = motion.command(k * STEP_NS * 1e-9, pose, pursuer)
        for _ in range(parts):
            dt_s = STEP_NS * 1e-9 / parts
            middle = pose.theta_rad + omega * dt_s / 2
            pose = Pose(pose.x_m + v * dt_s * cos(middle), pose.y_m + v * dt_s * sin(middle),
                        pose.theta_rad + omega * dt_s)
    return np.array(poses)


@pytest.mark.parametrize(("name", "path", "smoothed_s"), [("circle", "circle", 0.0), ("zig_zag", "zig-zag", 0.35)])
def test_circle_and_zig_zag_have_the_inputs_of_the_tables(name, path, smoothed_s):
    """Those of the zig-zag are means over 0.35 s, here over 350 instants: off by 1 in 350 of a jump of 1.5 rad/s."""
    motion, printed = MOTIONS[name](driver()), PATHS[path]()
    nowhere = Pose(0.0, 0.0, 0.0)

    for k in range(10, INSTANTS, 7):
        t_s = k * STEP_NS * 1e-9
        before = t_s - (np.arange(350) + 0.5) * smoothed_s / 350
        v, omega = np.mean([motion.command(float(at_s), nowhere, None) for at_s in before], axis=0)
        assert (v, omega) == pytest.approx((printed.v[k], printed.omega[k]), abs=1.6 * 2 / 350)


def test_speeds_scale_with_the_largest():
    fast, slow = (driven(MOTIONS["zig_zag"](driver(v)), 40) for v in (0.7, 0.35))

    assert slow[:, 0] == pytest.approx(fast[:, 0] / 2, abs=1e-12)


def test_a_wanderer_stays_in_its_area_and_sees_much_of_it():
    poses = driven(MOTIONS["waypoints"](driver()), 3000)

    assert np.abs(poses[:, 0]).max() < 2.0 + 0.5        # it turns in arcs
    assert np.abs(poses[:, 1]).max() < 1.0 + 0.5
    assert np.ptp(poses[:, 0]) > 2.0


@pytest.mark.parametrize("pursuer", [(-1.0, 0.2), (1.0, 0.0), (0.3, 2.0), (-0.5, -0.5)])
def test_a_runner_gets_away_from_a_pursuer_that_stands_nearly_at_full_speed(pursuer):
    poses = driven(MOTIONS["runner"](driver()), 200, pursuer)

    distances = np.hypot(poses[:, 0] - pursuer[0], poses[:, 1] - pursuer[1])
    assert (distances[-1] - distances[-51]) / (50 * 0.07) == pytest.approx(0.7, rel=0.01)
    assert distances.min() > distances[0] - 0.05


def test_a_runner_that_sees_nobody_stands():
    assert MOTIONS["runner"](driver()).command(0.0, Pose(0.0, 0.0, 0.0), None) == (0.0, 0.0)


def test_an_erratic_one_goes_everywhere_at_full_speed_or_not_at_all_and_comes_back():
    motion, pose, speeds, directions, places = MOTIONS["erratic"](driver(0.3)), Pose(0.0, 0.0, 0.0), set(), [], []
    for k in range(4000):
        v_x, v_y, omega = motion.command(k * 0.07, pose, None)
        speeds.add(round(hypot(v_x, v_y), 9))
        directions.append(remainder(atan2(v_y, v_x) - pose.theta_rad, 2 * pi))
        pose = Pose(pose.x_m + v_x * 0.07, pose.y_m + v_y * 0.07, pose.theta_rad + omega * 0.07)
        places.append((pose.x_m, pose.y_m))

    assert speeds == {0.0, 0.3}
    assert min(directions) < -2
    assert max(directions) > 2
    assert any(abs(abs(aside) - pi / 2) < 0.01 for aside in directions)
    assert np.abs(np.array(places)).max(axis=0) == pytest.approx([2.0, 1.0], abs=0.05)


def test_motions_depend_on_their_seed_only():
    first, second = (driven(MOTIONS["waypoints"](driver(seed=4)), 500) for _ in range(2))

    assert (first == second).all()
