"""A sensor robot by itself: what it does with sights, charges and news that come at known instants."""

from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from agents.pursuit.pursuer_settings import SensorSettings
from agents.pursuit.sensor_robot import SensorRobot
from agents.pursuit.team_frames import Charges, News, Report, Team, pack_charges, pack_news, unpack
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from netem.media.sensing.sight import LOOK, Detection, pack_detection, pack_nothing
from netem.node.node import Node
from netem.wire.messages import Grant
from tests.examples import examples

MS = 1_000_000
STEP_NS = 70 * MS
TEAM = Team(("s0", "s1"), ("t0", "t1"))
WHEELS = {"wheel_radius_m": 0.11, "track_m": 0.573, "counts_per_turn": 95_380}
VIEW, CAN, RADIO = 0, 1, 2


def sensor():
    node = Node("s0", ["view", "can", "radio"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, TEAM._asdict() | {"robot": WHEELS},
                  Random(1), {})
    board.keep_promises()
    SensorRobot(board, SensorSettings(radius_m=2.3, latency_ns=70 * MS))
    return node


def sight(k, x=1.0, y=0.0, name="t0"):
    """Of the k-th exposure, 20 ms later."""
    return k * STEP_NS + 20 * MS, VIEW, pack_detection(Detection(k * STEP_NS, x, y, 0.0, name))


def nothing(k):
    return k * STEP_NS + 20 * MS, VIEW, pack_nothing(k * STEP_NS)


def charges(at_ms, version, **target_of):
    return at_ms * MS, RADIO, pack_charges(TEAM, Charges(version, target_of))


def news(at_ms, target, seen_ms, x, y, sensor="s0"):
    return at_ms * MS, RADIO, pack_news(TEAM, News(sensor, target, ((seen_ms * MS, (x, y)),)))


def ran(*heard, until_ns=700 * MS):
    report = sensor().advance(Grant(1, until_ns, False, True, sorted(heard)))
    reports = [(time_ns, unpack(TEAM, data)) for time_ns, port, data in report.offers if port == RADIO]
    looks = [time_ns for time_ns, port, data in report.offers if port == VIEW and data == LOOK]
    return reports, looks, report


def test_an_idle_sensor_scans_at_every_exposure_and_reports_what_it_sees():
    reports, looks, _ = ran(sight(1), sight(2, x=1.5), nothing(3))

    assert [-(-at // STEP_NS) for at in looks] == list(range(1, 11))
    assert [(at, frame.seen_ns, frame.place) for at, frame in reports] == [
        (1 * STEP_NS + 22 * MS, STEP_NS, (1.0, 0.0)), (2 * STEP_NS + 22 * MS, 2 * STEP_NS, (1.5, 0.0))]


def test_who_is_there_at_the_first_scan_is_claimed_until_an_answer_comes():
    reports, _, _ = ran(sight(1), sight(2), sight(3), sight(4), charges(240, 1, s1="t0"))

    assert [frame.claims for _, frame in reports] == [True, True, True, False]


def test_later_only_who_enters_the_escape_area_is_claimed():
    inside = [nothing(1), sight(2, x=1.0)]                          # 1.3 m from the edge
    entering = [nothing(1), sight(2, x=1.9)]                        # 0.4 m from it

    assert [frame.claims for _, frame in ran(*inside)[0]] == [False]
    assert [frame.claims for _, frame in ran(*entering)[0]] == [True]


def test_in_charge_it_looks_by_the_policy_and_drives_no_more_than_it_has_to():
    _, looks, report = ran(charges(100, 1, s0="t0"), *(sight(k, x=0.5) for k in range(1, 6)), until_ns=2_000 * MS)

    exposures = [-(-at // STEP_NS) for at in looks]
    assert exposures == [1, 2, 3, 4, 5]     # two asked for while idle, three first ones; then not for 51 steps: 3.6 s
    assert [event[:3] for event in report.events if event[1] == "in charge"] == [(100 * MS, "in charge", "t0")]


def test_charges_of_an_older_version_change_nothing():
    _, _, report = ran(charges(50, 3, s0="t0"), charges(60, 2), charges(70, 3, s0="t1"), charges(80, 4, s0="t1"))

    assert [(event[0] // MS, event[2]) for event in report.events] == [(50, "t0"), (80, "t1")]


def test_news_of_its_target_count_others_and_known_instants_do_not():
    _, _, report = ran(charges(50, 1, s0="t0"), sight(1), news(150, "t0", 70, 5.0, 5.0), news(160, "t0", 140, 1.0, 0.0),
                       news(170, "t1", 140, 1.0, 0.0), news(180, "t0", 141, 1.0, 0.0, sensor="s1"))

    assert (report.counters["detections"], report.counters["detections of others"]) == (2, 1)


def test_a_sensor_that_is_relieved_stands_and_does_not_claim_who_is_still_there():
    reports, _, report = ran(sight(1), charges(100, 1, s0="t0"), charges(200, 2, s1="t0"), sight(4, x=2.0),
                             sight(5, x=2.0))

    assert [frame.claims for _, frame in reports][1:] == [False, False]
    assert report.events[-1][1] == "idle"


def test_who_came_while_it_was_in_charge_of_another_has_not_entered_just_now():
    """It cannot know: it did not scan then."""
    reports, _, _ = ran(sight(1), charges(100, 1, s0="t0"), charges(200, 2, s1="t0"), sight(4, x=2.0, name="t1"),
                        nothing(5), sight(6, x=2.0, name="t1"))

    assert [(frame.target, frame.claims) for _, frame in reports[1:]] == [("t1", False), ("t1", True)]


@given(st.lists(st.tuples(st.sampled_from([VIEW, CAN, RADIO]), st.sampled_from([b"", b"D", b"N", b"R", b"C"]),
                          st.binary(max_size=60)), max_size=8))
@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_bytes_of_anybody_never_raise(frames):
    ran(*[((10 + 7 * k) * MS, port, first + data) for k, (port, first, data) in enumerate(frames)], until_ns=200 * MS)


@pytest.mark.parametrize("place", [(float("nan"), 0.0), (0.0, float("inf"))])
def test_a_detection_that_is_no_place_is_refused_and_counted(place):
    _, _, report = ran(charges(50, 1, s0="t0"), sight(2, *place))

    assert report.counters["detections refused"] == 1


def test_a_report_is_told_with_the_sensors_own_noise():
    reports, _, _ = ran(sight(1))

    assert isinstance(reports[0][1], Report)
    assert reports[0][1].sigma_m == pytest.approx(0.1, rel=1e-6)
