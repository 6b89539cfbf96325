"""`marconet run --gdb`: gdb connects to a robot of a run, which waits and leaves the same ledger as without it."""

from __future__ import annotations

import importlib.util
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from experiments.run.runner import run
from experiments.scenario import load
from firmware_sim.firmware.new_folder import write_new
from marconet.command_line import app
from tests.firmware_sim.cortex_m.debugging import GDB, WITHIN_S, Packets, needs_gdb

PATIENCE_S = 15.0                       # node_timeout_s of the runs that wait longer for the debugger
TOO_LONG = f"shell sleep {PATIENCE_S + 4}"       # the inline watchdog ends the process 3 s after the time-out
pytestmark = pytest.mark.skipif(importlib.util.find_spec("unicorn") is None, reason="needs marconet[cortex-m]")


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    write_new(tmp_path / "blinker")
    path = tmp_path / "blinker" / "two_robots.toml"
    path.write_text(path.read_text().replace('firmware = "."', 'firmware = "."\ntarget = "cortex_m4"'))
    return path


class Waiting:
    """`marconet run --gdb a`, up to the line that says how to start gdb."""

    def __init__(self, scenario: Path, out: Path, *options: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "marconet.command_line", "run", str(scenario), "--out", str(out), "--no-report",
             "--gdb", "a", *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert self._process.stderr is not None
        line = self._process.stderr.readline()
        told = re.fullmatch(rf"a waits for gdb: {GDB} .* 'target remote 127\.0\.0\.1:(\d+)' (.*)\n", line)
        assert told, line
        self.port, self.image = int(told[1]), told[2]

    def gdb(self, *commands: str) -> str:
        words = ["set pagination off", f"target remote 127.0.0.1:{self.port}", *commands]
        done = subprocess.run([GDB, "-q", "-nx", "-batch", *(word for line in words for word in ("-ex", line)),
                               self.image], capture_output=True, text=True, timeout=WITHIN_S)
        return done.stdout + done.stderr

    def interrupt(self) -> None:
        self._process.send_signal(signal.SIGINT)

    def ended(self) -> tuple[int, str]:
        """Return exit code and output."""
        out, err = self._process.communicate(timeout=WITHIN_S)
        return self._process.returncode, out + err


def hash_alone(scenario: Path, out: Path) -> str:
    return run(load(scenario), host="inline", out=out, report=False).summary.ledger_hash


@needs_gdb
@pytest.mark.parametrize("host", ["inline", "process"])
def test_gdb_follows_a_robot_through_a_run(scenario: Path, tmp_path: Path, host: str) -> None:
    waiting = Waiting(scenario, tmp_path / "run", "--host", host)

    said = waiting.gdb("break board_receive", "continue", "backtrace", "continue", "reverse-continue", "monitor time",
                       "delete", "continue", "continue")
    code, told = waiting.ended()

    assert code == 0, told
    assert hash_alone(scenario, tmp_path / "alone") in told
    assert re.search(r"#0  board_receive .*\n#1  <signal handler called>\n#2 .* main \(\)", said), said
    assert "0.000" in said
    assert "exited normally" in said


@needs_gdb
@pytest.mark.slow
@pytest.mark.parametrize(("host", "before", "within"), [("inline", "info line", TOO_LONG),
                                                        ("process", TOO_LONG, "next")])
def test_time_outs_stand_still_while_the_program_does(scenario: Path, tmp_path: Path, host: str, before: str,
                                                      within: str) -> None:
    waiting = Waiting(scenario, tmp_path / "run", "--host", host, "--set", f"node_timeout_s={PATIENCE_S}")

    said = waiting.gdb(before, "break board_timer", "continue", within, "next", "delete", "continue")
    code, told = waiting.ended()

    assert code == 0, told
    assert hash_alone(scenario, tmp_path / "alone") in told
    assert "exited normally" in said


@pytest.mark.parametrize("host", [pytest.param("inline", marks=pytest.mark.slow), "process"])
def test_kill_ends_the_run_with_its_records(scenario: Path, tmp_path: Path, host: str) -> None:
    waiting = Waiting(scenario, tmp_path / "run", "--host", host)
    client = Packets(waiting.port)
    with client.socket:
        client.send(b"k")
        code, told = waiting.ended()

    assert code == 1, told              # what the scenario expects was not reached
    assert "by node a: the debugger of a ended it" in told
    assert (tmp_path / "run" / "ledger.parquet").exists()


@pytest.mark.parametrize("host", ["inline", pytest.param("process", marks=pytest.mark.slow)])
def test_ctrl_c_ends_a_run_that_waits_for_its_debugger(scenario: Path, tmp_path: Path, host: str) -> None:
    waiting = Waiting(scenario, tmp_path / "run", "--host", host)
    client = Packets(waiting.port)
    with client.socket:
        assert client.ask(b"?") == b"T05thread:1;"
        waiting.interrupt()
        code, told = waiting.ended()

        assert client.answer() in (b"", b"W00")
    assert code == 130, told
    assert "interrupted (SIGINT)" in told
    assert (tmp_path / "run" / "ledger.parquet").exists()


@pytest.mark.parametrize(("options", "says"), [
    (["--gdb", "c"], '--gdb c: no such agent; there are a, b'),
    (["--gdb", "a:x"], "--gdb a:x: expected NODE or NODE:PORT, as a:3333"),
    (["--gdb", "a", "--set", 'agents_defaults.target="host"'],
     "--gdb a: its program does not run on an emulated processor: expected a firmware with agents.a.target = "
     '"cortex_m4"'),
    (["--gdb", "a", "--real-time"], "--gdb a: while a program stands still, real time does not: run without"),
])
def test_what_cannot_be_debugged_is_refused(scenario: Path, tmp_path: Path, options: list[str], says: str) -> None:
    done = CliRunner().invoke(app, ["run", str(scenario), "--out", str(tmp_path / "run"), *options])

    assert done.exit_code == 2, done.output
    assert says in done.output
    assert not (tmp_path / "run").exists()


def test_a_port_that_is_taken_is_refused(scenario: Path, tmp_path: Path) -> None:
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        done = CliRunner().invoke(app, ["run", str(scenario), "--out", str(tmp_path / "run"), "--gdb", f"a:{port}"])

    assert done.exit_code == 2
    assert f"--gdb a:{port}: port {port}: Address already in use: leave it out, for any free one" in done.output


def test_the_command_names_a_gdb_that_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    from experiments.run.debugged import Debugged

    monkeypatch.setattr(shutil, "which", lambda name: name if name == "arm-none-eabi-gdb" else None)

    assert Debugged("a", 3333, Path("a b.elf"), (Path("src"),)).command == (
        "arm-none-eabi-gdb -q -d src -ex 'target remote 127.0.0.1:3333' 'a b.elf'")
