"""Real-time scheduling and locked memory, and what is said where they are not allowed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from netem.gateways.real_time_process import ALLOW_LOCKING, ALLOW_SCHEDULING, in_real_time

ASK = "from netem.gateways.real_time_process import in_real_time\nwith in_real_time(5) as why: print(*why, sep='\\n')"


def locked_kb() -> int:
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmLck:"))
    return int(line.split()[1])


def test_every_thread_is_scheduled_in_real_time_and_as_before_afterwards() -> None:
    with in_real_time(5) as refused:
        if refused:
            pytest.skip("; ".join(refused))
        threads = [int(entry.name) for entry in Path("/proc/self/task").iterdir()]
        policies = {os.sched_getscheduler(thread) for thread in threads}
        locked = locked_kb()
        later: list[int] = []
        thread = threading.Thread(target=lambda: later.append(os.sched_getscheduler(0)))
        thread.start()
        thread.join()

    assert policies == {os.SCHED_FIFO}
    assert later == [os.SCHED_FIFO]
    assert locked > 0
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
    assert locked_kb() == 0


@pytest.mark.skipif(shutil.which("setpriv") is None or os.geteuid() != 0, reason="needs root and setpriv")
def test_without_the_rights_both_are_refused_with_what_would_allow_them() -> None:
    without = ["setpriv", "--bounding-set=-sys_nice,-ipc_lock", "--inh-caps=-sys_nice,-ipc_lock"]

    done = subprocess.run([*without, sys.executable, "-c", ASK], capture_output=True, text=True, check=True)

    scheduling, locking = done.stdout.splitlines()
    assert scheduling == f"no real-time scheduling (Operation not permitted): {ALLOW_SCHEDULING}"
    assert locking == f"memory is not locked (limited by RLIMIT_MEMLOCK): {ALLOW_LOCKING}"
