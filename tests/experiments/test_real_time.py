"""A run in real time: as long as the robots' time, the same ledger, and somebody outside who takes part over UDP."""

from __future__ import annotations

import socket
import threading
import time
from pathlib import Path

import pytest

from experiments.judge.run_data import load_run
from experiments.run.runner import NeedsRealTime, run
from experiments.scenario import ScenarioError, find, load

ECHO = """
class Echo:
    def __init__(self, board):
        self.board = board
        self.port = board.port("radio", self.hear)
        board.at(20_000_000, lambda: self.port.send(b"hello"))

    def hear(self, data):
        self.board.count("heard")
        self.port.send(b"you said " + data)
"""
SCENARIO = """# A robot that answers.
# Question: does it answer somebody outside?
seed = 1
length_s = 0.6
[agents.robot]
program = "echo_robot:Echo"
[media.radio]
kind = "broadcast_radio"
preset = "xbee_802154"
[gateways.ground]
medium = "radio"
peer = "127.0.0.1:{port}"
[expect]
frames_delivered = {{ min = 1 }}
"""
AIRTIME_S = 0.000_5         # at 250 kbit/s no frame with its header takes less


class Ground(threading.Thread):
    """Waits for the robot's word, then asks ten times and notes how long each answer took."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(30.0)
        self.port = self.socket.getsockname()[1]
        self.heard: list[bytes] = []
        self.waits_s: list[float] = []

    def run(self) -> None:
        with self.socket:
            first, peer = self.socket.recvfrom(1000)
            self.heard.append(first)
            for k in range(10):
                asked_s = time.monotonic()
                self.socket.sendto(b"%d" % k, peer)
                self.heard.append(self.socket.recv(1000))
                self.waits_s.append(time.monotonic() - asked_s)


@pytest.mark.parametrize("host", ["inline", "process"])
def test_somebody_outside_is_answered_after_the_airtimes(tmp_path: Path, host):
    ground = Ground()
    (tmp_path / "echo_robot.py").write_text(ECHO)
    (tmp_path / "outside.toml").write_text(SCENARIO.format(port=ground.port))
    ground.start()

    result = run(load(tmp_path / "outside.toml"), host=host, out=tmp_path / "run", report=False, real_time=True)
    ground.join(timeout=5.0)
    data = load_run(result.folder)

    assert ground.heard == [b"hello", *(b"you said %d" % k for k in range(10))]
    assert min(ground.waits_s) >= 2 * AIRTIME_S             # there and back over the emulated radio
    assert result.summary.wall_s >= 0.6
    assert data.counters["robot"]["heard"] == 10
    assert len(data.ledger.only(sender="ground")) == 10
    assert data.run["real_time"]["instants"] > 20


def test_without_gateways_real_time_leaves_the_same_ledger_and_takes_its_time(tmp_path: Path):
    scenario = load(find("output_sync"), duration_s=0.3)

    fast = run(scenario, host="inline", out=tmp_path / "fast", report=False).summary
    paced = run(scenario, host="inline", out=tmp_path / "paced", report=False, real_time=True).summary

    assert paced.ledger_hash == fast.ledger_hash
    assert paced.wall_s >= 0.3
    assert fast.wall_s < 0.3


def test_gateways_need_real_time(tmp_path: Path):
    (tmp_path / "echo_robot.py").write_text(ECHO)
    (tmp_path / "outside.toml").write_text(SCENARIO.format(port=1))

    with pytest.raises(NeedsRealTime, match=r"gateways\.ground .* run it with --real-time"):
        run(load(tmp_path / "outside.toml"), host="inline", out=tmp_path / "run")


LATENESS = """
"real_time.lateness_median_s" = { min = 0.0, max = 5.0 }
"real_time.lateness_p99_s" = { min = 0.0, max = 5.0 }
"real_time.lateness_worst_s" = { max = 5.0 }
"real_time.overruns" = { max = 1000 }
"count.ground.datagrams received" = { min = 10, max = 10 }
"count.ground.datagrams refused" = { max = 0 }
"""


def test_lateness_and_the_datagrams_of_a_gateway_can_be_expected(tmp_path: Path):
    ground = Ground()
    (tmp_path / "echo_robot.py").write_text(ECHO)
    (tmp_path / "outside.toml").write_text(SCENARIO.format(port=ground.port) + LATENESS)
    ground.start()

    summary = run(load(tmp_path / "outside.toml"), host="inline", out=tmp_path / "run", report=False,
                  real_time=True).summary
    ground.join(timeout=5.0)

    value = {verdict.key: verdict.value for verdict in summary.verdicts}
    assert summary.holds, [verdict.by_how_much() for verdict in summary.verdicts]
    assert value["real_time.lateness_median_s"] <= value["real_time.lateness_p99_s"] <= value[
        "real_time.lateness_worst_s"]
    assert value["real_time.lateness_worst_s"] == summary.real_time["worst_ns"] / 1e9


def test_lateness_of_a_run_in_virtual_time_does_not_hold_and_says_why(tmp_path: Path):
    scenario = load(find("output_sync"), duration_s=0.1, overrides=["expect={\"real_time.overruns\"={max=0}}"])

    (verdict,) = run(scenario, host="inline", out=tmp_path / "run", report=False).summary.verdicts

    assert not verdict.holds
    assert verdict.by_how_much() == "lateness is that of a run in real time: run it with --real-time"


def test_an_unknown_figure_of_real_time_is_refused_with_the_nearest(tmp_path: Path):
    with pytest.raises(ScenarioError, match=r"real_time\.lateness_p95_s: .*nearest: real_time\.lateness_p99_s"):
        load(find("output_sync"), overrides=["expect={\"real_time.lateness_p95_s\"={max=0}}"])
