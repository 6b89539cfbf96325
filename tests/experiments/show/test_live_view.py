"""Progress on a terminal and in a file."""

from __future__ import annotations

import io

from rich.console import Console

from experiments.judge.run_result import Progress
from experiments.show.live_view import BAR_EVERY_S, LINE_EVERY_S, by_fate, counting_view, figures, live_view

LENGTH_S = 10.0


def progress(now_s: float, wall_s: float = 1.0, **frames: int) -> Progress:
    return Progress(round(now_s * 1e9), round(LENGTH_S * 1e9), wall_s, 1, frames)


class Clock:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def shown(terminal: bool, every_s: float, steps: int) -> str:
    """What is printed when the runner reports `steps` times, evenly over ten times `every_s`, and then the end."""
    clock, file = Clock(), io.StringIO()
    console = Console(file=file, force_terminal=terminal, width=100, color_system=None)
    with live_view(console, "talk", LENGTH_S, clock) as tell:
        for step in range(steps):
            clock.now_s = 100.0 + 10 * every_s * step / steps
            tell(progress(5.0, delivered=step))
        tell(progress(LENGTH_S, wall_s=2.0, delivered=7, lost=2))
    return file.getvalue()


def test_a_file_gets_a_line_now_and_then_and_one_at_the_end():
    lines = shown(False, LINE_EVERY_S, 5000).splitlines()

    assert len(lines) == 1 + 9 + 1
    assert lines[0] == "talk: 10 s of robot time"
    assert lines[-1] == "talk: 10.00 of 10.00 s  5.0 x real time  7 delivered, 2 lost on link"


def test_a_file_gets_no_control_characters():
    assert "\x1b" not in shown(False, LINE_EVERY_S, 100)


def test_a_terminal_gets_a_bar_that_is_not_drawn_for_every_window():
    few, many = (shown(True, BAR_EVERY_S, steps).count("talk") for steps in (100, 10_000))

    assert few <= many <= few + 1
    assert "5.0 x real time  7 delivered, 2 lost on link" in shown(True, BAR_EVERY_S, 100)


def test_figures_say_robot_time_pace_and_fates():
    line = figures(progress(5.0, 2.0, delivered=3, lost=0, deaf=1))

    assert line == "5.00 of 10.00 s  2.5 x real time  2 s left  3 delivered, 1 deaf"


def test_before_the_first_frame_there_is_nothing_to_divide_by():
    assert figures(progress(0.0, 0.0)) == "0.00 of 10.00 s  0.0 x real time  no frames yet"
    assert by_fate({"lost": 0}) == "no frames yet"


def counted(terminal: bool, every_s: float, runs: int) -> str:
    clock, file = Clock(), io.StringIO()
    console = Console(file=file, force_terminal=terminal, width=100, color_system=None)
    with counting_view(console, "table", runs, clock) as tell:
        for run in range(1, runs + 1):
            clock.now_s = 100.0 + 10 * every_s * run / runs
            tell()
    return file.getvalue()


def test_counted_work_is_told_of_now_and_then():
    lines = counted(False, LINE_EVERY_S, 1000).splitlines()

    assert lines == [f"table: {done} of 1000 runs" for done in range(100, 1001, 100)]


def test_counted_work_is_a_bar_on_a_terminal():
    assert "500 of 1000 runs" in counted(True, BAR_EVERY_S, 1000)


def test_whom_the_run_waits_for_is_said_at_once_and_then_now_and_then():
    clock, file = Clock(), io.StringIO()
    with live_view(Console(file=file, width=100), "talk", LENGTH_S, clock) as tell:
        for half_seconds in range(4, 20):
            clock.now_s = 100.0 + 0.5 * half_seconds
            tell(Progress(5, 10, 1.0, 1, {}, ["left", "right"], 0.5 * half_seconds))

    said = file.getvalue().splitlines()[1:]
    assert said[0] == "talk: waits for left, right: no answer for 2 s"
    assert len(said) == 2


def test_of_many_that_are_waited_for_some_are_named():
    assert figures(Progress(5, 10, 1.0, 1, {}, [f"r{k}" for k in range(128)], 3.0)) == (
        "waits for r0, r1, r2, r3, r4 and 123 more: no answer for 3 s")


def test_before_the_start_the_bar_shows_what_a_program_prepares():
    clock, file = Clock(), io.StringIO()
    console = Console(file=file, force_terminal=True, width=100, color_system=None)
    with live_view(console, "talk", LENGTH_S, clock) as tell:
        tell(Progress(0, round(LENGTH_S * 1e9), 0.0, 0, {}, preparing="tables: 3 of 4", prepared=0.75))
        clock.now_s += BAR_EVERY_S
        tell(progress(5.0))

    prepares, runs = (next(line for line in file.getvalue().split("\r") if what in line) for what in (
        "prepares tables: 3 of 4", "5.00 of 10.00 s"))
    assert [line.count("━") for line in (prepares, runs)] == [18, 12]      # of 24: three quarters, then a half
