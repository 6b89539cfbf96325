from __future__ import annotations

from math import acos, inf, nan, pi
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.autopilot.frames import down_axis, yaw_of
from firmware_sim.autopilot.parameters import TABLE, ParameterTable
from firmware_sim.autopilot.target_limits import limited
from firmware_sim.autopilot.vehicle import NO_AXIS, AttitudeTarget, PositionTarget, Target
from tests.firmware_sim.autopilot.attitude import from_roll_pitch_yaw

PARAMETERS = ParameterTable({"FENCE_XY": 4.0, "FENCE_ALT": 3.0, "VEL_MAX": 1.0, "ATT_TILT_MAX": 0.5}, lambda: None)
LEVEL = (1.0, 0.0, 0.0, 0.0)
ANY = st.floats()
AXIS = st.none() | ANY
TARGETS = st.builds(PositionTarget, st.tuples(AXIS, AXIS, AXIS), st.tuples(AXIS, AXIS, AXIS), AXIS, AXIS) | st.builds(
    AttitudeTarget, st.none() | st.tuples(ANY, ANY, ANY, ANY), st.none() | st.tuples(ANY, ANY, ANY), ANY)


@pytest.mark.parametrize("target", [
    PositionTarget((1.0, None, -2.0), (None, 0.5, None), yaw_rad=3.0),
    PositionTarget(NO_AXIS, (0.6, 0.8, -1.0), yaw_rate_radps=-1.0),
    AttitudeTarget(LEVEL, None, 0.4),
    AttitudeTarget(None, (1.0, -2.0, 0.0), 1.0),
])
def test_what_is_within_the_limits_is_left_alone(target: Target) -> None:
    assert limited(target, PARAMETERS) == (target, [])


@pytest.mark.parametrize(("target", "flown", "said"), [
    (PositionTarget((9.0, -4.5, 1.0)), PositionTarget((4.0, -4.0, 0.0)),
     ["position north 9 clipped to 4", "position east -4.5 clipped to -4", "position down 1 clipped to 0"]),
    (PositionTarget(NO_AXIS, (3.0, 4.0, 7.0)), PositionTarget(NO_AXIS, (0.6, 0.8, 1.0)),
     ["horizontal speed 5 clipped to 1", "velocity down 7 clipped to 1"]),
    (PositionTarget(yaw_rad=4.0, yaw_rate_radps=9.0), PositionTarget(yaw_rad=4.0 - 2 * pi, yaw_rate_radps=1.5),
     ["yaw rate 9 clipped to 1.5"]),
    (AttitudeTarget(LEVEL, (9.0, 0.0, 0.0), -0.5), AttitudeTarget(LEVEL, (4.0, 0.0, 0.0), 0.0),
     ["thrust -0.5 clipped to 0", "body rate x 9 clipped to 4"]),
])
def test_what_is_beyond_them_is_clipped_and_named(target: Target, flown: Target, said: list[str]) -> None:
    taken, named = limited(target, PARAMETERS)

    assert named == said
    assert taken == flown


def test_a_tilt_beyond_its_limit_keeps_direction_and_heading() -> None:
    taken, said = limited(AttitudeTarget(from_roll_pitch_yaw(1.0, 0.0, 0.7), None, 0.5), PARAMETERS)

    assert isinstance(taken, AttitudeTarget)
    assert taken.quaternion_wxyz is not None
    assert acos(down_axis(taken.quaternion_wxyz)[2]) == pytest.approx(0.5)
    assert yaw_of(taken.quaternion_wxyz) == pytest.approx(0.7, abs=1e-9)
    assert said == ["tilt 1 clipped to 0.5"]


@pytest.mark.parametrize(("target", "why"), [
    (PositionTarget((nan, 0.0, 0.0)), "position north is not finite: refused"),
    (PositionTarget(NO_AXIS, (0.0, 0.0, -inf)), "velocity down is not finite: refused"),
    (PositionTarget(yaw_rad=nan), "yaw is not finite: refused"),
    (AttitudeTarget(LEVEL, None, nan), "thrust is not finite: refused"),
    (AttitudeTarget((0.0, 0.0, 0.0, 0.0), None, 0.5), "attitude of length 0, not 1: refused"),
    (AttitudeTarget((0.0, 1.0, 0.0, 0.0), None, 0.5), "attitude upside down: refused"),
    (AttitudeTarget(None, None, 0.5), "neither attitude nor body rates: refused"),
])
def test_what_cannot_be_flown_is_refused_whole(target: Target, why: str) -> None:
    assert limited(target, PARAMETERS) == (None, [why])


@given(TARGETS)
def test_no_target_raises_and_what_is_taken_is_within_the_limits(target: Target) -> None:
    taken, said = limited(target, PARAMETERS)

    if taken is None:
        assert said
    elif isinstance(taken, PositionTarget):
        north, east, down = taken.position_ned_m
        assert max(abs(north or 0.0), abs(east or 0.0)) <= 4.0
        assert -3.0 <= (down or 0.0) <= 0.0
        assert (taken.velocity_ned_mps[0] or 0.0) ** 2 + (taken.velocity_ned_mps[1] or 0.0) ** 2 <= 1.0 + 1e-9
    else:
        assert 0.0 <= taken.thrust <= 1.0
        if taken.quaternion_wxyz is not None:
            assert acos(min(1.0, down_axis(taken.quaternion_wxyz)[2])) <= 0.5 + 1e-6


def test_the_table_of_parameters_keeps_its_own_rules_and_mavlinks_names() -> None:
    for name, info in TABLE.items():
        assert 0 < len(name) <= 16
        assert info.minimum <= info.default <= info.maximum
        assert info.about


def test_the_page_lists_the_parameters_as_they_are() -> None:
    page = (Path(__file__).parents[3] / "docs/models/autopilot.md").read_text(encoding="utf-8")

    rows = [f"| `{name}` | {info.default:g} {info.unit} | {info.minimum:g} to {info.maximum:g} | {info.about} |"
            for name, info in TABLE.items()]

    assert "\n".join(rows) in page


def test_a_parameter_is_set_within_its_bounds_and_who_uses_it_is_told() -> None:
    told: list[float] = []
    table = ParameterTable({}, lambda: told.append(table.get("VEL_MAX")))

    answers = [table.set("VEL_MAX", 2.0), table.set("VEL_MAX", 99.0), table.set("VEL_MAX", nan), table.set("NONE", 1.0)]

    assert answers == ["", "VEL_MAX=99: expected 0.1 to 10 m/s", "VEL_MAX=nan: expected 0.1 to 10 m/s",
                       "NONE: no such parameter"]
    assert told == [2.0]
    assert table.get("VEL_MAX") == 2.0


def test_start_values_that_are_wrong_come_all_at_once() -> None:
    with pytest.raises(ValueError) as caught:
        ParameterTable({"VEL_MAX": -1.0, "NONE": 0.0}, lambda: None)

    assert str(caught.value).splitlines() == ["VEL_MAX=-1: expected 0.1 to 10 m/s", "NONE: no such parameter"]
