"""A camera in a whole run: one ledger on both hosts, the truth of each exposure, mistakes before the start."""

from collections import Counter
from pathlib import Path

import pytest

from experiments.judge.run_data import load_run
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load

HOSTS: tuple[HostName, ...] = ("inline", "process")

WATCHER = '''
from netem.media.sensing.sight import LOOK, Detection, unpack_sight


class Watcher:
    def __init__(self, board):
        self.board = board
        self.port = board.port("view", self.hear, listen_only=True)

    def hear(self, data):
        sight = unpack_sight(data)
        if isinstance(sight, Detection):
            self.board.event("seen", f"{sight.exposed_ns} {sight.x_m!r} {sight.y_m!r}")
        else:
            self.board.event("not seen", str(sight.exposed_ns))

    def run(self):
        for k in range(40):
            yield from self.board.sleep_until(k * 100_000_000)
            self.port.send(LOOK)
'''
SCENARIO = '''# A camera watches a robot that leaves on a straight line.
# Question: is it seen?
seed = 1
length_s = 4.0
team.reference = { from_s = [0.0], v_mps = [1.0], omega_radps = [0.0] }
[agents.reference]
program = "agents.tracking.reference_robot:ReferenceRobot"
media = ["radio", "view"]
plant = { fmu = "virtual_reference", parameters_from = "team.reference" }
[agents.watcher]
program = "watcher:Watcher"
media = ["view"]
[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"
[media.view]
kind = "sensing"
exposure_period_ms = 70
latency_ms = 20
range_m = 2.5
bodies = { reference = ["x", "y", "theta"] }
'''


@pytest.fixture
def see(tmp_path: Path) -> Path:
    (tmp_path / "watcher.py").write_text(WATCHER, encoding="utf-8")
    (tmp_path / "see.toml").write_text(SCENARIO, encoding="utf-8")
    return tmp_path / "see.toml"


def test_both_hosts_see_the_truth_of_each_exposure_until_it_leaves_the_view(see, tmp_path):
    runs = [run(load(see), host=host, out=tmp_path / host, report=False) for host in HOSTS]

    assert runs[0].summary.ledger_hash == runs[1].summary.ledger_hash
    told = [event for event in load_run(runs[0].folder).events if event.node == "watcher"]
    seen = [tuple(map(float, event.detail.split())) for event in told if event.kind == "seen"]
    assert len(told) == 40
    assert [int(ns) for ns, _, _ in seen] == [-(-k * 100 // 70) * 70_000_000 for k in range(len(seen))]
    # At 1 m/s along x from the origin; each plant step rounds by less than 1e-12 m.
    assert all(abs(x_m - ns * 1e-9) < 1e-9 and y_m == 0.0 for ns, x_m, y_m in seen)
    assert seen[-1][0] <= 2.5e9 < seen[-1][0] + 2 * 100e6


def test_a_body_without_such_an_output_or_without_a_plant_is_refused_before_the_start(see):
    see.write_text(SCENARIO.replace('["x", "y", "theta"] }', '["x", "yy", "theta"], watcher = ["x", "y", "t"] }'),
                   encoding="utf-8")

    with pytest.raises(ScenarioError) as error:
        load(see)

    assert error.value.problems == [
        'see.toml: media.view.bodies.reference="yy": no such output; did you mean "y"?',
        "see.toml: media.view.bodies.watcher: a body needs a plant, whose outputs say where it is"]


QUADROTOR = '''# A quadrotor stands in a room with motion capture that loses frames.
# Question: does it learn where it is itself?
seed = 3
length_s = 2.0
sample_period_ms = 100
[agents.uav]
program = "firmware_sim.autopilot.autopilot:Autopilot"
plant = { fmu = "quadrotor", preset = "hummingbird", parameters = { x = 1.5, y = -0.5 } }
media = ["mocap"]
[media.mocap]
kind = "sensing"
exposure_period_ms = 10
latency_ms = 8
noise_m = 0.001
bodies = { uav = ["x", "y", "z", "heading"] }
fixed_cameras = ["uav"]
every_exposure_to = ["uav"]
[[impairments]]
on = "mocap: * -> uav"
kind = "bernoulli_loss"
loss_ratio = 0.3
[guarantees.fresh]
kind = "age_of_information"
on = "mocap: uav -> uav"
below_ms = 300
'''


def test_motion_capture_that_loses_frames_tells_a_vehicle_where_it_is_on_both_hosts(tmp_path):
    (tmp_path / "room.toml").write_text(QUADROTOR, encoding="utf-8")

    runs = [run(load(tmp_path / "room.toml"), host=host, out=tmp_path / host, report=False) for host in HOSTS]

    assert runs[0].summary.ledger_hash == runs[1].summary.ledger_hash
    data = load_run(runs[0].folder)
    fates = Counter(data.ledger.fate.values())
    assert fates.total() == len(data.ledger) == 200
    assert data.counters["uav"]["motion capture taken"] == fates["delivered"]
    assert abs(fates["lost"] - 60) < 4 * (200 * 0.3 * 0.7) ** 0.5
