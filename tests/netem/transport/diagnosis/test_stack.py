"""From what Python's fault handler wrote to the user's own line."""

from __future__ import annotations

import simpy

from netem.transport.diagnosis import stack
from netem.transport.diagnosis.stack import Frame, as_traceback, frames_to_show, is_users, place_of

DUMP = f"""Fatal Python error: Segmentation fault

Thread 0x00007f00 (most recent call first):
  File "{simpy.__file__}", line 3 in wait

Current thread 0x00007f01 (most recent call first):
  File "/usr/lib/python3.11/ctypes/__init__.py", line 519 in string_at
  File "/home/me/my robots.py", line 39 in act
  File "/home/me/my robots.py", line 20 in run
  File "{stack.__file__}", line 1 in advance

Extension modules: numpy (total: 1)
"""


def test_the_thread_at_which_the_signal_arrived_comes_first() -> None:
    threads = stack.threads_of(DUMP)

    assert [len(frames) for frames in threads] == [4, 1]


def test_the_place_is_the_innermost_line_of_the_users() -> None:
    """What the standard library of another installation does is no line of the user's either way."""
    dump = DUMP.replace('"/usr/lib/python3.11/ctypes/__init__.py"', f'"{simpy.__file__}"')

    place = place_of(frames_to_show(dump))

    assert place == Frame("/home/me/my robots.py", 39, "act")
    assert str(place) == "/home/me/my robots.py:39 in act"


def test_another_thread_is_shown_if_the_users_code_runs_there() -> None:
    dump = f"""Current thread 0x1 (most recent call first):
  File "{simpy.__file__}", line 3 in wait
Thread 0x2 (most recent call first):
  File "/home/me/robots.py", line 7 in program
"""

    assert place_of(frames_to_show(dump)) == Frame("/home/me/robots.py", 7, "program")


def test_without_a_line_of_the_users_the_innermost_is_the_place() -> None:
    dump = f'Current thread 0x1 (most recent call first):\n  File "{stack.__file__}", line 3 in advance\n'

    assert place_of(frames_to_show(dump)) == Frame(stack.__file__, 3, "advance")


def test_what_is_no_dump_has_no_place() -> None:
    assert [place_of(frames_to_show(text)) for text in ("", "  File \"x\", line 1 in y", "Current thread 0x1\n")] == [
        None, None, None]


def test_marconet_python_and_installed_packages_are_not_the_users() -> None:
    files = [stack.__file__, simpy.__file__, "<frozen runpy>", "<string>"]

    assert [is_users(Frame(file, 1, "f")) for file in files] == [False] * 4
    assert is_users(Frame(__file__, 1, "f"))


def test_the_traceback_begins_with_the_users_code_and_shows_its_source() -> None:
    line = test_the_traceback_begins_with_the_users_code_and_shows_its_source.__code__.co_firstlineno
    frames = [Frame(simpy.__file__, 1, "inner"), Frame(__file__, line, "mine"), Frame(stack.__file__, 1, "outer")]

    lines = as_traceback(frames).splitlines()

    assert lines[:2] == ["Stack (most recent call last):", f'  File "{__file__}", line {line}, in mine']
    assert lines[2].startswith("    def test_the_traceback_begins_with")
    assert lines[3].endswith("in inner")
    assert "outer" not in "".join(lines)
