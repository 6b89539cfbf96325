"""A run in real time: as long as the robots' time, the same ledger, and somebody outside who takes part over UDP."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import marconet
from experiments.judge.run_data import load_run
from experiments.run.runner import NeedsRealTime, run
from experiments.scenario import ScenarioError, find, load
from netem.gateways.pace import Overrun

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


@pytest.mark.parametrize(("name", "length_s", "rate", "host"), [
    ("output_sync", 0.3, 1.0, "inline"), ("output_sync", 0.2, 1.0, "process"), ("output_sync", 0.3, 1000.0, "inline"),
    ("three_servos_slow_bus", 0.4, 2.0, "inline"),
    *(pytest.param(*case, marks=pytest.mark.slow) for case in (
        ("tracking_lossy", 0.3, 2.0, "process"), ("marco_polo_zone", 0.5, 2.0, "inline"),
        ("hummingbird_chases_rovio", 0.3, 0.5, "inline"), ("faults_output_sync", None, 10.0, "inline")))])
def test_without_gateways_real_time_leaves_the_same_ledger_and_takes_its_time(
        tmp_path: Path, name, length_s, rate, host):
    """At 1000 virtual seconds a second no machine keeps the pace, so every instant is late."""
    scenario = load(find(name), duration_s=length_s, overrides=[f"real_time.rate={rate}"])

    fast = run(scenario, host="inline", out=tmp_path / "fast", report=False).summary
    paced = run(scenario, host=host, out=tmp_path / "paced", report=False, real_time=True).summary

    assert paced.ledger_hash == fast.ledger_hash
    assert paced.frames == fast.frames
    assert paced.wall_s >= scenario.length_ns / 1e9 / rate


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
late_p99_s = { min = 0.0, max = 5.0 }
late_worst_s = { max = 5.0 }
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
    assert value["late_worst_s"] == summary.real_time["deliveries"]["worst_ns"] / 1e9 >= value["late_p99_s"]
    assert summary.real_time["deliveries"]["events"] >= 10 + 11     # to the robot, and to the ground station


def test_a_run_to_which_no_program_outside_has_spoken_says_so(tmp_path: Path):
    (tmp_path / "echo_robot.py").write_text(ECHO)
    (tmp_path / "outside.toml").write_text(SCENARIO.format(port=9).replace('peer = "127.0.0.1:9"\n', ""))

    summary = run(load(tmp_path / "outside.toml", duration_s=0.05), host="inline", out=tmp_path / "run", report=False,
                  real_time=True).summary

    warning, = (warning for warning in summary.warnings if warning.startswith("gateways.ground: "))
    assert "no program outside the run sent a datagram to 127.0.0.1:" in warning


def test_lateness_of_a_run_in_virtual_time_does_not_hold_and_says_why(tmp_path: Path):
    scenario = load(find("output_sync"), duration_s=0.1, overrides=["expect={\"real_time.overruns\"={max=0}}"])

    (verdict,) = run(scenario, host="inline", out=tmp_path / "run", report=False).summary.verdicts

    assert not verdict.holds
    assert verdict.by_how_much() == "lateness is that of a run in real time: run it with --real-time"


def test_lateness_of_deliveries_is_expected_with_its_unit(tmp_path: Path):
    with pytest.raises(ScenarioError, match=r"expect\.late_p99: .*nearest: late_p99_s"):
        load(find("output_sync"), overrides=["expect={late_p99={max=0.001}}"])

    scenario = load(find("output_sync"), duration_s=0.1, overrides=["expect={late_p99_s={max=0.001}}"])
    (verdict,) = run(scenario, host="inline", out=tmp_path / "run", report=False).summary.verdicts

    assert not verdict.holds
    assert verdict.by_how_much() == "lateness is that of a run in real time: run it with --real-time"


BUSY = """
import time


class Busy:
    def __init__(self, board):
        port = board.port("radio", lambda data: None)
        board.at(20_000_000, self.work, sends=False)
        board.every(10_000_000, lambda: port.send(b"here"))

    def work(self):
        until_s = time.perf_counter() + 0.05
        while time.perf_counter() < until_s:
            pass
"""
LATE = """# A robot whose program takes longer than the time that passes for it.
# Question: does the run end, and say why?
seed = 1
length_s = 0.1
[agents.robot]
program = "busy_robot:Busy"
[media.radio]
kind = "broadcast_radio"
preset = "xbee_802154"
[real_time]
overrun_limit_ms = 15
"""


def late_scenario(folder: Path) -> Path:
    (folder / "busy_robot.py").write_text(BUSY)
    (folder / "late.toml").write_text(LATE)
    return folder / "late.toml"


@pytest.mark.parametrize("host", ["inline", "process"])
def test_a_run_that_is_late_goes_on_with_slip_and_ends_with_abort(tmp_path: Path, host):
    scenario = late_scenario(tmp_path)

    slipped = run(load(scenario), host=host, out=tmp_path / "slip", report=False, real_time=True).summary
    with pytest.raises(Overrun, match=r"the instant at 0\.0[0-9]+ s happened .* more than .*overrun_limit_ms = 15"):
        run(load(scenario, overrides=['real_time.overrun="abort"']), host=host, out=tmp_path / "abort", report=False,
            real_time=True)
    aborted = load_run(tmp_path / "abort")

    assert slipped.real_time["overruns"] >= 1
    assert slipped.reached_ns == 100_000_000
    assert aborted.run["reached_ns"] <= 50_000_000
    assert aborted.run["failure"].startswith("Overrun: the instant at")


def test_the_command_line_takes_rate_and_overrun_and_they_mean_real_time(tmp_path: Path):
    scenario = late_scenario(tmp_path)
    said = subprocess.run([Path(sys.executable).with_name("marconet"), "run", scenario, "--overrun", "abort", "--rate",
                           "0.5", "--set", "real_time.overrun_limit_ms=5", "--out", tmp_path / "run", "--no-report"],
                          capture_output=True, text=True, check=False)

    (line,) = [line for line in said.stderr.splitlines() if "behind the wall clock" in line]
    assert said.returncode == 3
    assert line.startswith("the instant at 0.0")
    assert "more than real_time.overrun_limit_ms = 5: lower --rate" in line


def test_a_rate_out_of_range_is_refused(tmp_path: Path):
    with pytest.raises(ScenarioError, match=r"output_sync\.toml: real_time\.rate=0\.0: .*0\.001"):
        load(find("output_sync"), overrides=["real_time.rate=0.0"])
    with pytest.raises(ValueError, match=r"rate=-1: expected virtual seconds per second .* from 0\.001 to 1000"):
        marconet.run(str(find("output_sync")), rate=-1, out=tmp_path)


def test_a_rate_stretches_the_wall_time_and_the_run_can_be_repeated(tmp_path: Path):
    scenario = marconet.load(find("output_sync"), length_s=0.2)

    began_s = time.monotonic()
    ran = marconet.run(scenario, host="inline", out=tmp_path / "slow", rate=0.5)

    assert time.monotonic() - began_s >= 0.4
    assert "--set real_time.rate=0.5" in ran.repeat()
    assert "--real-time" in ran.repeat()


@pytest.mark.skipif(os.geteuid() != 0, reason="needs the right to real-time scheduling")
@pytest.mark.parametrize(("wanted", "policies"), [("real_time", {os.SCHED_FIFO}), ("usual", {os.SCHED_OTHER})])
def test_nodes_are_scheduled_in_real_time_with_locked_memory(tmp_path: Path, wanted: str, policies: set[int]):
    (tmp_path / "looking.py").write_text("""
import os
from pathlib import Path


class Looks:
    def __init__(self, board):
        board.at(10_000_000, lambda: self.look(board))

    def look(self, board):
        for thread in Path("/proc/self/task").iterdir():
            board.count(f"policy {os.sched_getscheduler(int(thread.name))}")
        locked = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmLck")]
        board.count("locked kB", int(locked[0].split()[1]))
""")
    (tmp_path / "looks.toml").write_text(f"""# A robot looks at its scheduling.
seed = 1
length_s = 0.05
[agents.robot]
program = "looking:Looks"
[real_time]
scheduling = "{wanted}"
""")

    ran = run(load(tmp_path / "looks.toml"), out=tmp_path / "run", report=False, real_time=True)
    counted = load_run(ran.folder).counters["robot"]

    assert {int(name.split()[1]) for name in counted if name.startswith("policy")} == policies
    assert (counted["locked kB"] > 0) == (wanted == "real_time")


@pytest.mark.parametrize(("wanted", "kept_awake"), [("real_time", True), ("usual", False)])
def test_processors_are_kept_awake_unless_the_usual_scheduling_is_asked_for(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wanted: str, kept_awake: bool) -> None:
    (tmp_path / "driver").write_text("acpi_idle\n")
    monkeypatch.setattr("netem.gateways.awake.IDLE_DRIVER", tmp_path / "driver")
    monkeypatch.setattr("netem.gateways.awake.LATENCY", tmp_path / "nowhere" / "latency")

    ran = run(load(find("output_sync"), duration_s=0.05, overrides=[f'real_time.scheduling="{wanted}"']), host="inline",
              out=tmp_path / "run", report=False, real_time=True)

    told = [warning for warning in ran.summary.warnings if warning.startswith("idle processors sleep (No such file")]
    assert len(told) == kept_awake


def test_an_unknown_figure_of_real_time_is_refused_with_the_nearest(tmp_path: Path):
    with pytest.raises(ScenarioError, match=r"real_time\.lateness_p95_s: .*nearest: real_time\.lateness_p99_s"):
        load(find("output_sync"), overrides=["expect={\"real_time.lateness_p95_s\"={max=0}}"])
