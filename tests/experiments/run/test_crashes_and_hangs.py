"""Robots that crash or hang, as a user meets them: who, what and where, the same with processes and inline."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from experiments.run import runner
from experiments.scenario import load
from netem.wire.errors import NodeFailure

CASES = Path(__file__).parents[2] / "cases"
ROBOTS = CASES / "robots_that_misbehave"
COMMAND = [sys.executable, "-c", "from marconet.command_line import main; main()", "run"]

LONGEST_S = 60                  # a start that takes this long is not slow, but hangs


def failure_of(scenario: Path, host: runner.HostName, out: Path, timeout_s: float) -> NodeFailure:
    """The failure of the run with the shortest time-out of `timeout_s`, twice that, ... in which all robots started.

    The robots hang or crash only after their start; a loaded machine may take longer than `timeout_s` to start them.
    """
    with pytest.raises(NodeFailure) as failure:
        runner.run(load(scenario, overrides=[f"node_timeout_s={timeout_s}"]), host=host, out=out, report=False,
                   overwrite=True)
    if timeout_s < LONGEST_S and "no word that it is ready" in failure.value.reason:
        return failure_of(scenario, host, out, 2 * timeout_s)
    return failure.value


def line_of(file: Path, text: str) -> int:
    return next(number for number, line in enumerate(file.read_text().splitlines(), 1) if text in line)


@pytest.mark.parametrize("host", ["process", "inline"])
@pytest.mark.parametrize(("scenario", "file", "node", "code", "function"), [
    ("robots_that_misbehave/BusyLoop.toml", "robots.py", "bad", "while True: pass", "act"),
    pytest.param("novice/p05_inf.toml", "p05_inf.py", "r2", "while self.board.now_ns > 500_000_000: pass", "say",
                 marks=pytest.mark.slow),
])
def test_a_robot_that_hangs_is_named_with_its_line(scenario: str, file: str, node: str, code: str, function: str,
                                                   host: runner.HostName, tmp_path: Path) -> None:
    timeout_s = 4 if host == "process" else 1           # it also has to be up by then
    failure = failure_of(CASES / scenario, host, tmp_path, timeout_s)

    assert failure.node == node
    source = (CASES / scenario).with_name(file)
    assert re.fullmatch(r"no .* within node_timeout_s = [0-9.]+ s: it hangs at "
                        + re.escape(f"{source}:{line_of(source, code)} in {function}"), failure.reason)
    assert code in failure.detail


@pytest.mark.parametrize(("robot", "code", "what"), [
    ("Segv", "ctypes.string_at(0)", "its process was ended by SIGSEGV at"),
    ("Abort", "os.abort()", "its process was ended by SIGABRT at"),
    ("GilHold", "ctypes.PyDLL(None)", "it hangs at"),
    ("StopSelf", "signal.SIGSTOP", "it is stopped (SIGSTOP) at"),
])
def test_a_robot_that_ends_or_stops_its_process_is_named_with_its_line(robot: str, code: str, what: str,
                                                                       tmp_path: Path) -> None:
    failure = failure_of(ROBOTS / f"{robot}.toml", "process", tmp_path, 4.0)

    assert failure.node == "bad"
    assert f"{what} {ROBOTS / 'robots.py'}:{line_of(ROBOTS / 'robots.py', code)} in act" in failure.reason


@pytest.mark.parametrize(("plant", "what"), [("k07_segv", "its process was ended by SIGSEGV"), ("k03_inf", "it hangs")])
def test_a_plant_that_crashes_or_hangs_is_named_with_its_fmi_call(plant: str, what: str, tmp_path: Path) -> None:
    failure = failure_of(CASES / "novice" / f"{plant}.toml", "process", tmp_path, 4.0)

    carts = CASES / "novice" / "carts.py"
    assert (f"{what} in fmi3DoStep of plant {plant}, called at {carts}:{line_of(carts, 'board.sense')} in measure"
            in failure.reason)


def test_the_command_says_whom_it_waits_for_and_ends_with_the_code_of_a_failed_node(tmp_path: Path) -> None:
    for file in ("robots.py", "BusyLoop.toml"):
        shutil.copy(ROBOTS / file, tmp_path)

    began_s = time.monotonic()
    ended = subprocess.run([*COMMAND, "BusyLoop.toml", "--host", "inline", "--out", "out"], cwd=tmp_path,
                           capture_output=True, text=True, timeout=60)

    assert ended.returncode == 3
    assert "BusyLoop: waits for bad: no answer for 2 s" in ended.stdout
    assert re.search(r"^node bad: no answer within node_timeout_s = 4 s: it hangs at .*robots.py:\d+ in act",
                     ended.stderr, re.MULTILINE)
    assert (tmp_path / "out" / "ledger.parquet").is_file()
    assert time.monotonic() - began_s < 30


def test_an_inline_run_whose_plant_crashes_says_the_same_as_one_with_processes(tmp_path: Path) -> None:
    ended = subprocess.run([*COMMAND, str(CASES / "novice" / "k07_segv.toml"), "--host", "inline", "--out", "out"],
                           cwd=tmp_path, capture_output=True, text=True, timeout=60)

    carts = CASES / "novice" / "carts.py"
    assert ended.returncode == 3
    assert re.search(r"^node (left|right): its process was ended by SIGSEGV in fmi3DoStep of plant k07_segv, called at "
                     rf"{re.escape(str(carts))}:{line_of(carts, 'board.sense')} in measure$", ended.stderr,
                     re.MULTILINE)


@pytest.mark.slow
def test_an_inline_robot_that_stops_its_process_is_named_with_its_line(tmp_path: Path) -> None:
    ended = subprocess.run([*COMMAND, str(ROBOTS / "StopSelf.toml"), "--host", "inline", "--out", "out"], cwd=tmp_path,
                           capture_output=True, text=True, timeout=60)

    line = line_of(ROBOTS / "robots.py", "signal.SIGSTOP")
    assert ended.returncode == 3
    assert ended.stderr.startswith("node bad: no answer within node_timeout_s = 4 s: it is stopped (SIGSTOP) at "
                                   f"{ROBOTS / 'robots.py'}:{line} in act")
    assert "it is stopped" in (tmp_path / "out" / "summary.json").read_text()
    assert (tmp_path / "out" / "report.html").is_file()


def test_a_process_that_does_not_end_after_the_run_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    result = runner.run(load(ROBOTS / "AtExitHang.toml"), host="process", out=tmp_path, report=False)

    assert result.summary.holds
    assert [message for message in caplog.messages if message.startswith(
        f"node bad: its process did not end within 5 s, and was killed: it hangs at {ROBOTS / 'robots.py'}:")]
