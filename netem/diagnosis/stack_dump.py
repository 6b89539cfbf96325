"""Python's fault handler of this process writes behind the memory of `UnderWay`: at a crash, and at `DUMP_SIGNAL`.

It runs in the signal handler itself, so it also shows a process whose interpreter is held by one long call into C.
"""

from __future__ import annotations

import faulthandler
import signal
from typing import Final

from netem.diagnosis.under_way import UnderWay

DUMP_SIGNAL: Final = signal.SIGRTMAX - 5        # programs use SIGUSR1 and SIGUSR2 for their own purposes


def dump_stacks_into(under_way: UnderWay) -> None:
    faulthandler.enable(under_way.file, all_threads=True)
    faulthandler.register(DUMP_SIGNAL, under_way.file, all_threads=True, chain=False)
