"""The flying pursuer's computer: what it hands out, what it refuses, and one chase on both hosts."""

from __future__ import annotations

from math import pi
from pathlib import Path
from random import Random

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from agents.pursuit.aerial_companion import AerialCompanion, CompanionSettings
from agents.pursuit.aerial_settings import AerialSettings
from agents.pursuit.flight_signals import distances, heights, in_degrees
from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, find, load
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from netem.media.sensing.sight import LOOK, Detection, pack_detection, pack_nothing
from netem.node.node import Node
from netem.wire.messages import Grant

MS = 1_000_000
STEP_NS, EXECUTION_NS = 70 * MS, 5 * MS
SURE = {"height_m": 1.5, "radius_m": 1.2, "no_moving_m": 0.3, "escape_m": 0.4, "v_max_mps": 0.3, "sigma_m": 0.02,
        "rho_m": 0.1, "speed_mps": 0.9, "response_ns": 700 * MS}
VIEW, LINK = 0, 1


class Bench:
    """A companion alone; what the vehicle says is pymavlink's."""

    def __init__(self, **settings):
        self.node = Node("companion", ["view", "link"])
        board = Board(self.node, LocalClock(ClockSettings(), self.node.env.time_ns), None, {}, Random(1), {})
        board.keep_promises()
        self.companion = AerialCompanion(board, CompanionSettings("rovio", AerialSettings(**SURE | settings)))
        self.node.start(self.companion.run())
        self.node.hello()
        self.now_ns, self.arrivals, self.sent = 0, [], []
        self.vehicle = common.MAVLink(None, srcSystem=1, srcComponent=1)
        self.parser = common.MAVLink(None)
        self.orders = 0

    def hear(self, port, data, after_ns=1):
        self.arrivals.append((self.now_ns + after_ns, port, data))

    def says(self, message):
        self.hear(LINK, message.pack(self.vehicle))

    def step(self):
        """One instant; offers are also kept as (time, port, what pymavlink reads of it, or the bytes)."""
        end_ns = self.now_ns + STEP_NS
        report = self.node.advance(Grant(1, end_ns, False, False, sorted(self.arrivals)))
        self.arrivals, self.now_ns, found = [], end_ns, []
        for time_ns, port, data in report.offers:
            for message in self.parser.parse_buffer(data) or [] if port == LINK else [data]:
                found.append((time_ns, port, message))
        self.sent += found
        return found

    def obey(self, seconds, north=0.5, east=-0.25, mode=(6 << 16)):
        """A vehicle that flies where it is told, says so every instant, and accepts everything."""
        for _ in range(round(seconds * 1e9 / STEP_NS)):
            self.says(self.vehicle.heartbeat_encode(2, 12, 128, mode if self.orders >= 5 else 4 << 16 | 3 << 24, 4))
            self.says(self.vehicle.local_position_ned_encode(0, north, east, -1.5, 0, 0, 0))
            for _, port, message in self.step():
                if port == LINK and message.get_type() == "COMMAND_LONG":
                    self.orders += 1
                    self.says(self.vehicle.command_ack_encode(message.command, 0, 0, 0, 245, 191))

    def targets(self):
        return [message for _, port, message in self.sent
                if port == LINK and message.get_type() == "SET_POSITION_TARGET_LOCAL_NED"]


def test_it_hands_out_nothing_but_an_execution_time_after_its_instants_and_promises_so():
    bench = Bench()

    bench.obey(3.0)

    assert bench.sent
    assert {time_ns % STEP_NS for time_ns, _, _ in bench.sent} == {EXECUTION_NS}
    assert bench.node.hello().firm_ns >= bench.now_ns


def test_before_it_has_seen_anything_the_waypoint_is_where_the_vehicle_is_at_its_height_and_heading():
    bench = Bench(heading_rad=0.5)

    bench.obey(3.0, north=0.5, east=-0.25)

    target = bench.targets()[-1]
    assert (target.x, target.y, target.z) == (0.5, -0.25, -1.5)
    assert target.yaw == pytest.approx(pi / 2 - 0.5, abs=1e-6)     # a float on the wire


def test_a_detection_becomes_a_waypoint_of_east_and_north_at_the_next_instant_and_is_repeated():
    bench = Bench(resend_every=2)
    bench.obey(3.0, north=0.5, east=-0.25)
    looked = [time_ns for time_ns, port, data in bench.sent if port == VIEW and data == LOOK]

    bench.hear(VIEW, pack_detection(Detection(bench.now_ns - STEP_NS, 0.25, 0.75, 0.0, "rovio")))
    before = len(bench.targets())
    bench.obey(1.0, north=0.5, east=-0.25)

    assert looked                                                   # without it there was nothing to tell
    after = bench.targets()[before:]
    assert [(target.x, target.y) for target in after[1:]] == [(0.75, 0.25)] * (len(after) - 1)
    assert len(after) == pytest.approx(14 / 2, abs=1)               # 14 instants


def test_a_detection_in_the_no_moving_area_stops_the_vehicle_where_it_is():
    bench = Bench()
    bench.obey(3.0, north=0.5, east=-0.25)

    bench.hear(VIEW, pack_detection(Detection(bench.now_ns - STEP_NS, -0.15, 0.55, 0.0, "rovio")))
    bench.obey(1.0, north=0.5, east=-0.25)

    assert (bench.targets()[-1].x, bench.targets()[-1].y) == (0.5, -0.25)


def test_unreadable_untimely_and_foreign_news_move_nothing():
    bench = Bench()
    bench.obey(3.0)

    bench.hear(VIEW, b"garbage")
    bench.hear(VIEW, pack_nothing(bench.now_ns))
    bench.hear(VIEW, pack_detection(Detection(bench.now_ns + 10**12, 5.0, 5.0, 0.0, "rovio")))
    bench.hear(VIEW, pack_detection(Detection(bench.now_ns, float("nan"), 5.0, 0.0, "rovio")), 2)
    bench.hear(VIEW, pack_detection(Detection(bench.now_ns, 5.0, 5.0, 0.0, "bystander")))
    bench.obey(1.0)

    assert {(target.x, target.y) for target in bench.targets()} == {(0.5, -0.25)}
    counts = bench.node.advance(Grant(2, bench.now_ns, False, True, [])).counters
    assert (counts["unreadable frames"], counts["looks that saw nothing"], counts["detections refused"]) == (1, 1, 2)


def test_a_vehicle_that_lands_by_itself_gets_no_more_waypoints():
    bench = Bench()
    bench.obey(3.0)

    bench.obey(0.3, mode=4 << 16 | 6 << 24)         # LAND
    before = len(bench.targets())
    bench.obey(2.0)

    assert len(bench.targets()) == before


# --- what it refuses

@pytest.mark.parametrize(("wrong", "says"), [
    ({"response_ns": 2_000 * MS}, "escape_m=0.4: a target of 0.3 m/s"),
    ({"gain_per_s": 0.5}, "no_moving_m=0.3: with a gain of 0.5 /s the pursuer is slower"),
    ({"no_moving_m": 0.9}, "the field of view is too small for its zones"),
    ({"speed_mps": 0.2}, "u_max_mps=0.2: the pursuer has to be faster"),
    ({"window": 2}, "Gamma of 3 detections or more"),
    ({"execution_ns": STEP_NS}, "0 <= execution < step"),
    ({"resend_every": 0}, "resend_every=0"), ({"height_m": 0.0}, "height_m=0.0")])
def test_settings_that_cannot_work_are_refused(wrong, says):
    with pytest.raises(ValueError) as refused:
        AerialSettings(**{**SURE, **wrong})

    assert says in str(refused.value)


@pytest.mark.parametrize(("key", "value", "says"), [
    ("agents.companion.parameters.pursuit.escape_m", 0.2, "pursuit.escape_m=0.2: a target of 0.3 m/s"),
    ("agents.companion.parameters.link", "air", "parameters.link=air: no such port; it is on view, ground_line"),
    ("media.view.range_m", 1.0, "radius_m=1.2: media.view has range_m=1.0"),
    ("media.view.exposure_period_ms", 100, "step_ns=70000000: media.view has exposures every 100000000 ns")])
def test_a_scenario_that_cannot_work_is_refused_before_the_start(key, value, says):
    text = f'"{value}"' if isinstance(value, str) else value

    with pytest.raises(ScenarioError) as refused:
        load(find("hummingbird_chases_rovio"), overrides=[f"{key}={text}"])

    assert says in str(refused.value)


# --- signals of the report, and the chase itself

def test_signals_of_the_report_are_degrees_without_jumps_heights_and_distances():
    turning = np.array([3.0, 3.1, -3.1])            # through half a turn

    degrees, = in_degrees(turning)
    up = heights(np.array([1.0]), np.array([-1.25]))
    away, = distances(np.array([1.0]), np.array([1.0]), np.array([4.0]), np.array([5.0]))

    assert np.allclose(np.diff(degrees), np.rad2deg([0.1, 2 * pi - 6.2]))
    assert [float(one[0]) for one in up] == [1.0, 1.25]
    assert float(away[0]) == 5.0


@pytest.mark.slow
def test_both_hosts_and_a_repeated_run_leave_the_same_ledger(tmp_path: Path):
    runs = [run(load(find("hummingbird_chases_rovio"), duration_s=4.5), host=host, out=tmp_path / f"{k}", report=False)
            for k, host in enumerate(("inline", "inline", "process"))]

    assert len({one.summary.ledger_hash for one in runs}) == 1
    phases = [event.detail for event in load_run(runs[2].folder).events if event.kind == "phase"]
    assert phases[-1] == "chase"
