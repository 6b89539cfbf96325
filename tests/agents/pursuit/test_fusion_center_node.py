"""The fusion center as a node: what it answers to frames at known instants."""

from random import Random

import pytest

from agents.pursuit.fusion_center_node import FusionCenterNode, FusionCenterSettings
from agents.pursuit.team_frames import Charges, News, Report, Team, pack_report, unpack
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from netem.node.node import Node
from netem.wire.messages import Grant

MS = 1_000_000
TEAM = Team(("a", "b", "c"), ("t0", "t1"))


def answers(*heard, until_ns=400 * MS, **parameters):
    """[(time [ms], frame)], counters, of a center that hears (time [ms], report or bytes)."""
    node = Node("center", ["radio"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, TEAM._asdict(), Random(1), {})
    board.keep_promises()
    FusionCenterNode(board, FusionCenterSettings(**parameters))
    report = node.advance(Grant(1, until_ns, False, True, [
        (at_ms * MS, 0, frame if isinstance(frame, bytes) else pack_report(TEAM, frame)) for at_ms, frame in heard]))
    return [(time_ns / MS, unpack(TEAM, data)) for time_ns, _, data in report.offers], report.counters


def reading(sensor, target="t0", seen_ms=0, place=(1.0, 2.0), claims=False):
    return Report(sensor, target, claims, seen_ms * MS, place, 0.125)


def test_a_claim_is_answered_an_execution_time_later_to_everybody():
    told, _ = answers((10, reading("a", claims=True)))

    assert told == [(11.0, Charges(1, {"a": "t0"}))]


def test_who_is_in_charge_is_told_again_every_half_second():
    told, _ = answers((10, reading("a", claims=True)), until_ns=1_600 * MS)

    assert told == [(at_ms, Charges(1, {"a": "t0"})) for at_ms in (11.0, 500.0, 1000.0, 1500.0)]


def test_a_sensor_that_the_target_comes_to_takes_it_over():
    told, counters = answers((10, reading("a", claims=True)), (80, reading("b", seen_ms=70, claims=True)))

    assert told[:2] == [(11.0, Charges(1, {"a": "t0"})), (81.0, Charges(2, {"b": "t0"}))]
    assert counters["hand-overs"] == 1


def test_of_two_that_see_it_enter_at_one_instant_the_first_to_be_heard_has_it():
    told, counters = answers((10, reading("b", claims=True)), (12, reading("a", claims=True)))

    assert told == [(11.0, Charges(1, {"b": "t0"})), (13.0, Charges(2, {"b": "t0"}))]
    assert counters["hand-overs"] == 0


def test_a_claim_by_who_has_a_target_already_changes_nothing_and_is_answered():
    told, _ = answers((10, reading("a", claims=True)), (80, reading("a", "t1", seen_ms=70, claims=True)))

    assert told == [(11.0, Charges(1, {"a": "t0"})), (81.0, Charges(2, {"a": "t0"}))]


def test_what_others_saw_is_merged_and_passed_on_to_who_is_in_charge():
    told, counters = answers(
        (10, reading("a", claims=True)), (75, reading("b", seen_ms=70, place=(1.0, 3.0))),
        (80, reading("c", seen_ms=70, place=(2.0, 5.0))))

    assert told[1:] == [(95.0, News("a", "t0", ((70 * MS, (1.5, 4.0)),)))]      # 20 ms after the first of the instant
    assert counters["merged"] == 1


def test_what_the_sensor_in_charge_saw_itself_is_not_told_to_it():
    told, _ = answers((10, reading("a", claims=True)), (75, reading("a", seen_ms=70)))

    assert told == [(11.0, Charges(1, {"a": "t0"}))]


def test_a_new_one_in_charge_is_told_what_was_seen_before():
    told, _ = answers((10, reading("a", claims=True)), (40, reading("a", seen_ms=35, place=(3.0, 1.0))),
                      (80, reading("b", seen_ms=70, claims=True)))

    assert (100.0, News("b", "t0", ((0, (1.0, 2.0)), (35 * MS, (3.0, 1.0))))) in told


def test_frames_that_are_wrong_are_counted_and_answered_by_nothing():
    told, counters = answers((10, b"R"), (11, b""), (12, reading("a", seen_ms=50)), (13, reading("b")),
                             (14, reading("b")), (15, b"C\0\0\0\1\xff"))

    assert told == []
    assert (counters["unreadable frames"], counters["readings refused"], counters["frames of others"]) == (2, 2, 1)


@pytest.mark.parametrize("parameters", [{"execution_ns": 0}, {"execution_ns": 2, "gather_ns": 1}, {"repeat_ns": 0}])
def test_settings_that_make_no_sense_are_refused(parameters):
    with pytest.raises(ValueError, match="expected 0 < execution <= gather"):
        answers(**parameters)
