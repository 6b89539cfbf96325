"""What a sensor knows of a target: independent detections, the expected motion, intercepts; and grip frames."""

from __future__ import annotations

from math import hypot

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo_game.grip_frames import Grip, Held, pack, unpack
from agents.marco_polo_game.track import STEP_NS, Seen, Track
from agents.pursuit.law import Area

S = 1_000_000_000
AREA = Area((0.0, 10.0), (0.0, 10.0))


def track(*seen: tuple[str, int, float, float]) -> Track:
    found = Track(AREA, GameParameters())
    for sensor, at_ns, x, y in seen:
        found.detected(sensor, Seen(at_ns, (x, y)))
    return found


def test_a_second_detection_by_one_sensor_is_no_independent_one() -> None:
    found = track(("a", S, 1.0, 1.0), ("b", 2 * S, 2.0, 1.0))

    assert found.detections == 2
    assert not found.detected("a", Seen(3 * S, (2.5, 1.0)))
    assert found.detections == 2
    assert found.forecast().seen_ns == 3 * S            # it is the newest one all the same


def test_a_straight_track_is_forecast_until_its_exit() -> None:
    found = track(("a", 0, 1.0, 5.0), ("b", 4 * S, 3.0, 5.0)).forecast()        # 0.5 m/s to the right

    assert found.speed_mps == pytest.approx(0.5)
    assert found.exit_place == pytest.approx((10.0, 5.0))
    assert found.leaves_ns == 18 * S
    assert found.place(6 * S) == pytest.approx((4.0, 5.0))
    assert found.place(20 * S) == pytest.approx((10.0, 5.0))


def test_speeds_stay_within_those_of_targets() -> None:
    assert track(("a", 0, 1.0, 5.0), ("b", S, 3.0, 5.0)).forecast().speed_mps == 0.7
    assert track(("a", 0, 1.0, 5.0), ("b", 90 * S, 3.0, 5.0)).forecast().speed_mps == 0.3
    assert track(("a", 0, 1.0, 5.0), ("b", 0, 1.0, 5.0)).forecast().speed_mps == 0.5    # two fields of view overlap


@given(st.floats(0.0, 10.0), st.floats(0.0, 10.0), st.integers(4 * S, 17 * S))
def test_an_intercept_is_the_first_place_where_the_sensor_is_no_later(x: float, y: float, now_ns: int) -> None:
    found = track(("a", 0, 1.0, 5.0), ("b", 4 * S, 3.0, 5.0)).forecast()

    place = found.intercept((x, y), 1.2, now_ns)

    met_ns = (place[0] - 3.0) / 0.5 * 1e9 + 4 * S       # when the target is there
    if place != found.exit_place:
        assert hypot(place[0] - x, place[1] - y) <= 1.2 * (met_ns - now_ns) * 1e-9 + 1e-6
    before_ns = met_ns - STEP_NS - 1
    if before_ns > now_ns:
        earlier = found.place(round(before_ns))
        assert hypot(earlier[0] - x, earlier[1] - y) > 1.2 * (before_ns - now_ns) * 1e-9 - 1e-6


@given(st.integers(0, 255), st.integers(0, 255), st.floats(-50.0, 50.0, width=32), st.floats(-50.0, 50.0, width=32))
def test_grip_frames_are_read_as_written(target: int, sensor: int, x_m: float, y_m: float) -> None:
    for frame in (Grip(target, sensor, x_m, y_m), Held(target, sensor)):
        found = unpack(pack(frame))

        assert type(found) is type(frame)
        assert found == frame


@given(st.binary(max_size=16))
def test_other_bytes_are_no_grip_frame(data: bytes) -> None:
    found = unpack(data)

    assert found is None or pack(found) == data
