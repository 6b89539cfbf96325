"""Processors that do not idle during a run in real time, and what is said where that is not allowed."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from netem.gateways import awake as module
from netem.gateways.awake import ALLOW_LATENCY, awake


def spinning() -> set[int]:
    """Return the processors of this process's threads with the lowest priority."""
    threads = [int(entry.name) for entry in Path("/proc/self/task").iterdir()]
    return {processor for thread in threads if os.sched_getscheduler(thread) == os.SCHED_IDLE
            for processor in os.sched_getaffinity(thread)}


def idle_s() -> float:
    """Return how long all processors of the machine together have been idle."""
    words = Path("/proc/stat").read_text().splitlines()[0].split()
    return int(words[4]) / os.sysconf("SC_CLK_TCK")


@pytest.fixture
def no_driver(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "driver").write_text("none\n")
    monkeypatch.setattr(module, "IDLE_DRIVER", tmp_path / "driver")


@pytest.fixture
def a_driver(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "driver").write_text("intel_idle\n")
    monkeypatch.setattr(module, "IDLE_DRIVER", tmp_path / "driver")
    monkeypatch.setattr(module, "LATENCY", tmp_path / "latency")
    return tmp_path / "latency"


@pytest.mark.usefixtures("no_driver")
def test_each_processor_has_a_spinning_thread_of_the_lowest_priority_until_the_end() -> None:
    processors = os.sched_getaffinity(0)

    with awake(processors) as refused:
        found, before_s = spinning(), idle_s()
        time.sleep(0.3)
        idled_s = idle_s() - before_s

    assert refused == ""
    assert found == processors
    assert spinning() == set()
    if len(processors) == os.cpu_count():
        assert idled_s < 0.1 * 0.3 * len(processors)        # all of it on a machine with nothing to do


@pytest.mark.usefixtures("no_driver")
def test_only_the_processors_asked_for_are_kept_awake() -> None:
    with awake({min(os.sched_getaffinity(0))}):
        assert spinning() == {min(os.sched_getaffinity(0))}


def test_a_kernel_with_idle_states_is_asked_for_a_latency_of_0(a_driver: Path) -> None:
    a_driver.write_bytes(b"")

    with awake(os.sched_getaffinity(0)) as refused:
        assert a_driver.read_bytes() == bytes(4)
        assert any(os.path.realpath(entry) == str(a_driver) for entry in Path("/proc/self/fd").iterdir())

    assert refused == ""
    assert spinning() == set()
    assert not any(os.path.realpath(entry) == str(a_driver) for entry in Path("/proc/self/fd").iterdir())


def test_without_the_right_it_says_so_with_the_remedy(a_driver: Path) -> None:
    a_driver.mkdir()                        # a file that not even root can write

    with awake(os.sched_getaffinity(0)) as refused:
        pass

    assert refused == f"idle processors sleep (Is a directory: {a_driver}): {ALLOW_LATENCY}"
