"""Keeps processors from idling, since one that has been idle wakes up late.

An idle processor of a computer falls into sleep states and returns from them within some 0.1 ms; an idle processor of a
virtual machine is taken back by the host and returns within some ms. On a computer, a process that holds
`/dev/cpu_dma_latency` open with 0 in it keeps processors out of these states. A kernel without a driver of idle states,
as in most virtual machines, does not act on that file; there a process of ours (`awake_process.py`) spins on each
processor with the lowest priority. In a control group with a quota of processor time nothing spins, as that would use
the quota up.

Source: Documentation/power/pm_qos_interface.rst, Documentation/admin-guide/pm/cpuidle.rst and cgroup-v2.rst of Linux.
"""

from __future__ import annotations

import os
import select
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

IDLE_DRIVER: Final = Path("/sys/devices/system/cpu/cpuidle/current_driver")
LATENCY: Final = Path("/dev/cpu_dma_latency")
GROUPS: Final = Path("/sys/fs/cgroup")
OWN_GROUP: Final = Path("/proc/self/cgroup")
ALLOW_LATENCY: Final = f"run as root, or let a udev rule give your group the right to write {LATENCY}"
ALLOW_SPINNING: Final = "run without a quota, as `docker run --cpuset-cpus 0,1` in place of `--cpus 2`"
PROGRAM: Final = Path(__file__).with_name("awake_process.py")
MOST_S: Final = 5.0                 # for the process to begin


@contextmanager
def awake() -> Iterator[str]:
    """Keep the processors that this thread may use from idling during the `with` block.

    The block gets "", or why they may idle, with the remedy.
    """
    if _idle_driver():
        held, refused = _no_latency()
    elif quota := _quota():
        held, refused = -1, f"idle processors sleep ({quota}): {ALLOW_SPINNING}"
    else:
        with _spinning(os.sched_getaffinity(0)) as refused:
            yield refused
        return
    try:
        yield refused
    finally:
        if held >= 0:
            os.close(held)


def _no_latency() -> tuple[int, str]:
    """Ask the kernel to keep processors out of sleep states; return the descriptor to hold, and "" or why not."""
    held = -1
    try:
        held = os.open(LATENCY, os.O_WRONLY | os.O_CLOEXEC)
        os.write(held, bytes(4))                    # an int32 of 0 us
    except OSError as error:
        return held, f"idle processors sleep ({error.strerror}: {LATENCY}): {ALLOW_LATENCY}"
    return held, ""


@contextmanager
def _spinning(processors: set[int]) -> Iterator[str]:
    """Let a process spin on `processors` during the `with` block, which gets "" or why it does not."""
    owner = os.getpid()
    try:
        process = subprocess.Popen([sys.executable, "-I", "-S", str(PROGRAM), *map(str, sorted(processors))],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)
    except OSError as error:
        yield f"idle processors sleep ({error.strerror}: {sys.executable})"
        return
    assert process.stdout is not None
    assert process.stdin is not None
    try:
        if select.select([process.stdout], [], [], MOST_S)[0]:
            told = os.read(process.stdout.fileno(), 1000).decode().strip() or f"{PROGRAM.name} ended"
        else:
            told = f"{PROGRAM.name} is not ready after {MOST_S:g} s"
        yield "" if told == "spins" else f"idle processors sleep ({told})"
    finally:
        process.stdout.close()
        process.stdin.close()
        if os.getpid() == owner:                    # a forked child leaves the block, too
            process.kill()
            process.wait()


def _idle_driver() -> str:
    """Return the name of the kernel's driver of idle states, or "" if it has none."""
    with suppress(OSError):
        name = IDLE_DRIVER.read_text().strip()
        return "" if name == "none" else name
    return ""


def _quota() -> str:
    """Return the limit of processor time of this process's control group, or of one around it; "" if there is none."""
    with suppress(OSError):
        for line in OWN_GROUP.read_text().splitlines():
            _, _, named = line.partition(":")
            controllers, _, own = named.partition(":")
            if controllers and "cpu" not in controllers.split(","):
                continue
            top = GROUPS / controllers              # version 2 has all controllers in one tree
            group = top / own.lstrip("/")
            for folder in (group, *group.parents):
                if not folder.is_relative_to(top):
                    break
                for name in ("cpu.max", "cpu.cfs_quota_us"):
                    with suppress(OSError):
                        if (limit := (folder / name).read_text().split()[0]) not in {"max", "-1"}:
                            return f"{folder / name} is {limit}"
    return ""
