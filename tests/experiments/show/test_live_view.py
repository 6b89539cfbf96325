"""Progress on a terminal and in a file."""

from __future__ import annotations

import io

import msgspec
import pytest
from rich.console import Console

from experiments.judge.run_result import Progress, lateness_in_words
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
    line = figures(progress(5.0, 2.0, delivered=3, lost=0, deaf=1), "2 s left")

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

    assert lines[0] == "table: 20 of 1000 runs, 49 s left"          # the first estimate is told after a second
    assert [line.partition(" of ")[0] for line in lines[1:]] == [f"table: {done}" for done in range(120, 1000, 100)]


def test_the_first_run_of_a_search_tells_how_long_the_others_take():
    clock, file = Clock(), io.StringIO()
    with counting_view(Console(file=file, width=100), "break talk", 200, clock) as tell:
        clock.now_s += 30                               # for the start of processes
        tell(0)
        clock.now_s += 2
        tell()

    assert file.getvalue().splitlines() == ["break talk: 0 of 200 runs", "break talk: 1 of 200 runs, 6 min 38 s left"]


def test_of_runs_of_which_there_may_be_fewer_no_time_is_said_to_be_left():
    clock, file = Clock(), io.StringIO()
    with counting_view(Console(file=file, width=100), "shrink run", 500, clock, at_most=True) as tell:
        clock.now_s += 2
        tell()

    assert file.getvalue().splitlines() == ["shrink run: 1 of at most 500 runs"]


def told(*steps: Progress) -> list[str]:
    """Return the lines of a file for these steps, LINE_EVERY_S apart."""
    clock, file = Clock(), io.StringIO()
    with live_view(Console(file=file, width=100), "talk", LENGTH_S, clock) as tell:
        for step in steps:
            clock.now_s += LINE_EVERY_S
            tell(step)
    return file.getvalue().splitlines()[1:]


def test_the_time_left_does_not_count_the_start_and_is_told_from_one_hundredth_on():
    start, early, later = told(progress(0.001, wall_s=50.0), progress(0.1, wall_s=50.1), progress(2.001, wall_s=54.0))

    assert "left" not in start + early
    assert "  16 s left  " in later


def test_while_a_view_holds_the_run_no_time_is_said_to_be_left_and_its_pause_does_not_count_afterwards():
    def held(now_s: float, wall_s: float) -> Progress:
        return msgspec.structs.replace(progress(now_s, wall_s=wall_s), held=True)

    lines = told(progress(1.0, wall_s=0.0), progress(2.0, wall_s=2.0), held(2.0, 2.0), held(2.1, 600.0),
                 progress(2.2, wall_s=600.2), progress(4.2, wall_s=604.2))

    assert ["left" in line for line in lines] == [False, True, False, False, False, True]
    assert "12 s left" in lines[-1]


def test_counted_work_is_a_bar_on_a_terminal():
    assert "502 of 1000 runs, 0 s left" in counted(True, BAR_EVERY_S, 1000)


def test_whom_the_run_waits_for_is_said_at_once_and_then_now_and_then():
    clock, file = Clock(), io.StringIO()
    with live_view(Console(file=file, width=100), "talk", LENGTH_S, clock) as tell:
        for half_seconds in range(4, 20):
            clock.now_s = 100.0 + 0.5 * half_seconds
            tell(Progress(5, 10, 1.0, 1, {}, ["left", "right"], 0.5 * half_seconds))

    said = file.getvalue().splitlines()[1:]
    assert said[0] == "talk: waits for left, right: no answer for 2 s"
    assert len(said) == 2


@pytest.mark.parametrize(("overruns", "said"), [(0, "no overrun"), (1, "1 overrun"), (2, "2 overruns")])
def test_one_overrun_is_no_plural(overruns: int, said: str) -> None:
    late = {"median_ns": 1, "p99_ns": 1, "worst_ns": 1, "overruns": overruns}

    assert lateness_in_words(late).endswith(f"; {said}")


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
