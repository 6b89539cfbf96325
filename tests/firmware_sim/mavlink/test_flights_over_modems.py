"""A quadrotor behind a pair of lossy radio modems, flown in virtual time by a companion computer over MAVLink."""

from __future__ import annotations

from math import sqrt
from pathlib import Path

import pytest

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load

COMPANION = """
from dataclasses import dataclass
from math import dist

from firmware_sim.autopilot.vehicle import Mode, PositionTarget
from firmware_sim.mavlink.companion import Companion
from firmware_sim.mavlink.enums import Command
from firmware_sim.mavlink.link import MavlinkLink

CORNERS = ((1.0, 0.0, -1.0), (1.0, 1.0, -1.0), (0.0, 0.0, -1.0))
TICK_NS = 50_000_000


class Flyer:
    @dataclass
    class Settings:
        line: str

    def __init__(self, board, settings):
        self.board = board
        self.port = board.port(settings.line, self.hear, listen_only=True)
        self.companion = Companion(MavlinkLink(245, 190))
        self.next_ns = 0

    def hear(self, data):
        for message in self.companion.hear(data, self.board.now_ns):
            self.board.count(f"heard {message.name}")

    def tick(self, *frames):
        for frame in (*frames, *self.companion.step(self.board.now_ns)):
            self.port.send(frame)
        self.next_ns += TICK_NS
        yield from self.board.sleep_until(self.next_ns)

    def until(self, wanted, *frame):
        while not wanted():
            yield from self.tick(*(make() for make in frame))

    def run(self):
        board, companion = self.board, self.companion
        yield from self.until(lambda: companion.position_ned_m is not None)
        companion.command(Command.COMPONENT_ARM_DISARM, 1)
        companion.take_off(489.0)
        yield from self.until(lambda: companion.mode is Mode.HOLD and companion.landed_state == 2)
        board.event("flew up")
        companion.set_mode(Mode.OFFBOARD)
        for corner in CORNERS:
            target = PositionTarget(corner)
            yield from self.until(lambda: dist(companion.position_ned_m, corner) < 0.2,
                                  lambda: companion.target(target, self.board.now_ns))
            board.event("corner", str(corner))
        companion.command(Command.NAV_LAND)
        yield from self.until(lambda: not companion.armed)
        board.event("landed", ", ".join(f"{command.name} {result.name}" for command, result in companion.answers))
        while True:
            yield from self.tick()
"""
SCENARIO = """# A companion flies a quadrotor through radio modems.
# Question: does it land?
seed = 5
length_s = 22.0
sample_period_ms = 50
[agents.quadrotor]
program = "firmware_sim.mavlink.mavlink_autopilot:MavlinkAutopilot"
plant = { fmu = "quadrotor", preset = "hummingbird" }
media = ["mocap", "uart"]
[agents.quadrotor.parameters.mavlink]
period_ms = 10
budget_bytes_per_s = 2_000
streams_hz = { ATTITUDE = 0.0, GLOBAL_POSITION_INT = 0.0, GPS_RAW_INT = 0.0, VFR_HUD = 0.0 }
[agents.air_modem]
program = "firmware_sim.radio_modem:RadioModem"
parameters = { serial = "uart", radio = "air", baud_bps = 57_600 }
media = ["uart", "air"]
[agents.ground_modem]
program = "firmware_sim.radio_modem:RadioModem"
parameters = { serial = "ground_uart", radio = "air", baud_bps = 57_600 }
media = ["air", "ground_uart"]
[agents.companion]
program = "flyer:Flyer"
parameters = { line = "ground_uart" }
media = ["ground_uart"]
[media.mocap]
kind = "sensing"
exposure_period_ms = 10
latency_ms = 10
bodies = { quadrotor = ["x", "y", "z", "heading"] }
every_exposure_to = ["quadrotor"]
fixed_cameras = ["quadrotor"]
[media.uart]
kind = "serial_line"
baud_bps = 57_600
chunk_bytes = 3
[media.ground_uart]
kind = "serial_line"
baud_bps = 57_600
chunk_bytes = 3
[media.air]
kind = "broadcast_radio"
preset = "xbee_802154"
mac = "csma"
[[impairments]]
on = "air: * -> *"
kind = "bernoulli_loss"
loss_ratio = 0.1
"""


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    (tmp_path / "flyer.py").write_text(COMPANION, encoding="utf-8")
    (tmp_path / "flight.toml").write_text(SCENARIO, encoding="utf-8")
    return tmp_path / "flight.toml"


def test_a_companion_flies_it_through_a_link_that_loses_a_tenth_of_the_packets(flight, tmp_path):
    result = run(load(flight), host="inline", out=tmp_path / "run", report=False)
    data = load_run(result.folder)

    told = [event.kind for event in data.events if event.node == "companion"]
    assert told == ["flew up", "corner", "corner", "corner", "landed"]
    packets = data.ledger.only(medium="air")
    lost = len(packets.only(fate="lost")) / len(packets)
    assert abs(lost - 0.1) < 4 * sqrt(0.1 * 0.9 / len(packets))
    up = len(packets.only(sender="ground_modem", fate="lost"))
    assert up > 0
    assert data.counters["quadrotor"]["mavlink frames lost"] > 0            # told by gaps in sequence numbers
    assert data.counters["quadrotor"]["mavlink setpoints taken"] > 20       # 20 a second on the way to each corner


def test_both_hosts_give_one_ledger(flight, tmp_path):
    runs = [run(load(flight, duration_s=2.0), host=host, out=tmp_path / host, report=False)
            for host in ("inline", "process")]

    assert runs[0].summary.ledger_hash == runs[1].summary.ledger_hash


@pytest.mark.parametrize(("old", "new", "says"), [
    ("period_ms = 10\nbudget", "period_mss = 10\nbudget", "period_mss"),
    ("budget_bytes_per_s = 2_000", "budget_bytes_per_s = -1", "budget_bytes_per_s=-1: expected 0"),
    ("ATTITUDE = 0.0", "ATTITUDES = 0.0", "no such stream"),
    ("period_ms = 10\nbudget", 'port = "mocap"\nbudget', "mavlink.port='mocap': no such free port; there are uart"),
    ('media = ["mocap", "uart"]', 'media = ["mocap"]', "a serial line has two ends, this one 1: air_modem"),
    ('preset = "hummingbird" }\nmedia = ["mocap", "uart"]', 'preset = "hummingbird" }\nmedia = ["uart"]', "mocap")])
def test_settings_that_do_not_fit_are_refused_before_the_start(flight, old, new, says):
    assert old in SCENARIO
    flight.write_text(SCENARIO.replace(old, new), encoding="utf-8")

    with pytest.raises(ScenarioError) as error:
        load(flight)

    assert any(says in problem for problem in error.value.problems)
