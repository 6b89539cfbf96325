"""The tests themselves: they find the same where they run in the background, and none is skipped unnoticed."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tests.collecting import LEADER, InLine

ROOT = Path(__file__).parents[1]
IGNORE = "import os, signal, sys; signal.signal(int(sys.argv[1]), signal.SIG_IGN); os.execv(sys.argv[2], sys.argv[2:])"
REPORTS = """
import signal, subprocess, sys

def test_what_it_starts_ignores_nothing():
    which = "import signal; print([signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGHUP)])"
    told = subprocess.run([sys.executable, "-c", which], capture_output=True, text=True).stdout
    assert "SIG_IGN" not in told and "default_int_handler" in told, told
"""
SKIPS = """
import pytest

def test_it():
    pytest.skip("needs a thing: `apt-get install thing`")
"""


def pytest_in(folder: Path, test: str, *options: str, before: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    (folder / "conftest.py").write_text((ROOT / "tests" / "conftest.py").read_text())
    (folder / "test_one.py").write_text(test)
    return subprocess.run([*before, sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir",
                           str(folder), *options, str(folder)], cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP], ids=["&", "nohup"])
def test_what_a_background_job_ignores_reaches_the_programs_under_test(tmp_path: Path, number: signal.Signals) -> None:
    done = pytest_in(tmp_path, REPORTS, before=(sys.executable, "-c", IGNORE, str(int(number))))

    assert done.returncode == 0, done.stdout


def test_a_skipped_test_fails_on_request_and_says_what_is_needed(tmp_path: Path) -> None:
    done = pytest_in(tmp_path, SKIPS, "--fail-on-skip")

    assert done.returncode == 1
    assert "needs a thing: `apt-get install thing`" in done.stdout
    assert pytest_in(tmp_path, SKIPS).returncode == 0


def test_a_worker_collects_a_file_once_the_leader_has(tmp_path: Path) -> None:
    (file := tmp_path / "collected").touch()
    module = pytest.Module.__new__(pytest.Module)
    led = InLine(LEADER, file).pytest_make_collect_report(module)
    followed = InLine("gw1", file).pytest_make_collect_report(module)
    collects = threading.Event()
    threading.Thread(target=lambda: (next(followed), collects.set()), daemon=True).start()

    next(led)                                   # the leader imports the file
    early = collects.wait(0.1)
    with pytest.raises(StopIteration):
        led.send(None)                          # and has done

    assert not early
    assert collects.wait(60)
