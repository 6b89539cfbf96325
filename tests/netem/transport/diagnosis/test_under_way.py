"""Memory that tells after a crash what a process did."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys

import pytest

from netem.transport.diagnosis import words
from netem.transport.diagnosis.under_way import LONGEST_NAME, MEMORY_BYTES, UnderWay

CRASHES = """
import ctypes, os, signal, sys
from netem.transport.diagnosis.stack_dump import dump_stacks_into
from netem.transport.diagnosis.under_way import UnderWay
under_way = UnderWay(int(sys.argv[1]))
dump_stacks_into(under_way)
under_way.words[0] = 3
under_way.call_word[0] = under_way.place("fmi3DoStep of plant cart")
def fails():
    {action}
fails()
"""


def crash(action: str) -> tuple[int, UnderWay]:
    under_way = UnderWay()
    code = subprocess.run([sys.executable, "-c", CRASHES.format(action=action), str(under_way.file)],
                          pass_fds=[under_way.file], stderr=subprocess.DEVNULL).returncode
    return code, under_way


@pytest.mark.parametrize(("action", "name"), [("ctypes.string_at(0)", "SIGSEGV"), ("os.abort()", "SIGABRT"),
                                              ("os.kill(os.getpid(), signal.SIGFPE)", "SIGFPE")])
def test_after_a_crash_another_process_reads_node_call_and_stack(action: str, name: str) -> None:
    code, under_way = crash(action)

    assert under_way.running() == 3
    assert words.ended(code, under_way).startswith(f"was ended by {name} in fmi3DoStep of plant cart, called at ")
    assert "in fails" in words.stack(under_way)


def test_a_process_that_the_system_killed_leaves_its_call_without_a_stack() -> None:
    code, under_way = crash("os.kill(os.getpid(), signal.SIGKILL)")

    assert words.ended(code, under_way) == ("was ended by SIGKILL in fmi3DoStep of plant cart: the system ends a "
                                            "process so when memory runs out")
    assert words.stack(under_way) == ""


def test_a_real_time_signal_without_a_name_is_told_by_its_number() -> None:
    assert words.ended(-(signal.SIGRTMIN + 3)) == f"was ended by signal {signal.SIGRTMIN + 3}"


def test_names_share_a_place_and_end_when_the_memory_is_full() -> None:
    under_way = UnderWay()

    first, again, other = (under_way.place(name) for name in ("a", "a", "b"))
    many = [under_way.place(f"{k}{'x' * LONGEST_NAME}") for k in range(MEMORY_BYTES // LONGEST_NAME + 10)]
    under_way.call_word[0] = other

    assert first == again != other
    assert many[-1] == 0
    assert under_way.call() == "b"


def test_whatever_a_process_writes_there_can_be_read() -> None:
    rng = random.Random("under way")
    under_way = UnderWay()
    for _ in range(200):
        os.pwrite(under_way.file, rng.randbytes(64), rng.choice((0, 8, 16, MEMORY_BYTES - 32, MEMORY_BYTES)))
        under_way.words[1] = rng.choice((-1, 16, MEMORY_BYTES - 1, MEMORY_BYTES, 1 << 62, 40))

        assert isinstance(words.ended(-11, under_way) + words.stack(under_way), str)
