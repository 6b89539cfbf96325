"""Processors that do not idle during a run in real time, and what is said where that is not allowed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from netem.gateways import awake as module
from netem.gateways.awake import ALLOW_LATENCY, ALLOW_SPINNING, awake

BUSY = "import time\nbegan = time.process_time()\nend = time.monotonic() + 0.6\nwhile time.monotonic() < end: pass\n" \
       "print(time.process_time() - began)"


def until(true: Callable[[], bool], what: str) -> None:
    end_s = time.monotonic() + 20
    while not true():
        assert time.monotonic() < end_s, f"waited 20 s for {what}"
        time.sleep(0.01)


def spinning(parent: int | None = None) -> dict[int, float]:
    """Return the processors of the threads of SCHED_IDLE in children of `parent`, and their processor time [s]."""
    found: dict[int, float] = {}
    for stat in Path("/proc").glob("[0-9]*/task/[0-9]*/stat"):
        with suppress(OSError, ProcessLookupError):
            words = stat.read_text().rpartition(")")[2].split()
            thread = int(stat.parent.name)
            if int(words[1]) == (parent or os.getpid()) and os.sched_getscheduler(thread) == os.SCHED_IDLE:
                (processor,) = os.sched_getaffinity(thread)
                found[processor] = int(words[11]) / os.sysconf("SC_CLK_TCK")
    return found


@pytest.fixture
def no_driver(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "driver").write_text("none\n")
    (tmp_path / "group").write_text("")
    monkeypatch.setattr(module, "IDLE_DRIVER", tmp_path / "driver")
    monkeypatch.setattr(module, "OWN_GROUP", tmp_path / "group")


@pytest.fixture
def a_driver(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "driver").write_text("intel_idle\n")
    monkeypatch.setattr(module, "IDLE_DRIVER", tmp_path / "driver")
    monkeypatch.setattr(module, "LATENCY", tmp_path / "latency")
    return tmp_path / "latency"


@pytest.mark.usefixtures("no_driver")
def test_a_process_spins_on_each_processor_with_the_lowest_priority_until_the_end() -> None:
    processors = os.sched_getaffinity(0)

    with awake() as refused:
        found = spinning()
        until(lambda: sum(spinning().values()) > 0, "a spinning thread to get a processor")     # others run before it

    assert refused == ""
    assert set(found) == processors
    assert spinning() == {}


@pytest.mark.usefixtures("no_driver")
def test_only_processors_that_this_thread_may_use_are_kept_awake() -> None:
    processors = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(processors)})
    try:
        with awake():
            found = set(spinning())
    finally:
        os.sched_setaffinity(0, processors)

    assert found == {min(processors)}


@pytest.mark.usefixtures("no_driver")
def test_a_forked_child_that_leaves_the_block_ends_nothing() -> None:
    block = awake()
    with block:
        child = os.fork()
        if not child:
            try:
                block.__exit__(None, None, None)
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        found = set(spinning())

    assert found == os.sched_getaffinity(0)


def test_the_process_ends_with_its_parent(tmp_path: Path) -> None:
    (tmp_path / "driver").write_text("none\n")
    code = ("import sys, time\nfrom pathlib import Path\nfrom netem.gateways import awake\n"
            "awake.IDLE_DRIVER = awake.OWN_GROUP = Path(sys.argv[1])\n"
            "with awake.awake() as why: print(why, flush=True); time.sleep(60)")
    parent = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "driver")], stdout=subprocess.PIPE)
    try:
        assert parent.stdout is not None
        assert parent.stdout.readline() == b"\n"
        (child,) = (int(word) for word in Path(f"/proc/{parent.pid}/task/{parent.pid}/children").read_text().split())
        assert set(spinning(parent.pid)) == os.sched_getaffinity(0)
    finally:
        parent.send_signal(signal.SIGKILL)
        parent.communicate()

    until(lambda: not Path(f"/proc/{child}").exists(), "the spinning process to end")


@pytest.mark.usefixtures("no_driver")
def test_a_program_of_another_session_gets_the_processor() -> None:
    processors = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(processors)})          # its child inherits that
    try:
        with awake():
            began_s = time.monotonic()
            busy = subprocess.run([sys.executable, "-c", BUSY], start_new_session=True, capture_output=True, text=True,
                                  check=True)
            took_s, load = time.monotonic() - began_s, os.getloadavg()[0]
    finally:
        os.sched_setaffinity(0, processors)

    if load >= 1.5 or took_s >= 1.2:
        pytest.skip(f"other programs take the processor, too: load {load:.1f}")
    assert float(busy.stdout) > 0.45            # it got 0.3 of its 0.6 s while the run's own session spun


def test_a_kernel_with_idle_states_is_asked_for_a_latency_of_0(a_driver: Path) -> None:
    a_driver.write_bytes(b"")

    with awake() as refused:
        assert a_driver.read_bytes() == bytes(4)
        assert any(os.path.realpath(entry) == str(a_driver) for entry in Path("/proc/self/fd").iterdir())
        assert spinning() == {}

    assert refused == ""
    assert not any(os.path.realpath(entry) == str(a_driver) for entry in Path("/proc/self/fd").iterdir())


def test_without_the_right_it_says_so_with_the_remedy(a_driver: Path) -> None:
    a_driver.mkdir()                        # a file that not even root can write

    with awake() as refused:
        pass

    assert refused == f"idle processors sleep (Is a directory: {a_driver}): {ALLOW_LATENCY}"


@pytest.mark.usefixtures("no_driver")
@pytest.mark.parametrize(("line", "folder", "name", "limit"), [
    ("0::/docker/one", "docker", "cpu.max", "100000 100000"),
    ("4:cpu,cpuacct:/docker/one", "cpu,cpuacct/docker/one", "cpu.cfs_quota_us", "50000")])
def test_nothing_spins_where_processor_time_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str,
                                                       folder: str, name: str, limit: str) -> None:
    monkeypatch.setattr(module, "GROUPS", tmp_path)
    (tmp_path / "group").write_text(f"3:memory:/elsewhere\n{line}\n")
    (tmp_path / folder).mkdir(parents=True)
    (tmp_path / folder / name).write_text(limit)

    with awake() as refused:
        found = spinning()

    place = tmp_path / folder / name
    assert refused == f"idle processors sleep ({place} is {limit.split()[0]}): {ALLOW_SPINNING}"
    assert found == {}


@pytest.mark.usefixtures("no_driver")
def test_a_processor_that_is_refused_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {100_000})

    with awake() as refused:
        pass

    assert refused == "idle processors sleep (Invalid argument: processor 100000)"
