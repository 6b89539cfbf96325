"""Shows the progress of a run: a bar on a terminal, a line every few seconds elsewhere.

The runner calls the view after windows and, from the thread that watches the nodes, while it waits for a node. The view
draws at most once every BAR_EVERY_S or LINE_EVERY_S.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from experiments.judge.run_result import Progress, by_fate
from experiments.show.console import PlainConsole
from experiments.show.time_left import TimeLeft

if TYPE_CHECKING:
    from experiments.show.console import Console

BAR_EVERY_S = 0.1
LINE_EVERY_S = 5.0
MOST_NAMES = 5          # most nodes named in the line about nodes that do not answer
SOON_S = 1.0            # in a file, no line for work that is done by then
LEAST_SHARE = 0.01      # of a run, before the time left is estimated; of counted runs it is one


class Count(Protocol):
    def __call__(self, more: int = 1) -> None:
        """Tell that `more` runs have ended; 0: that the first ones begin."""


@contextmanager
def live_view(console: Console, what: str, length_s: float,
              now_s: Callable[[], float] = time.monotonic) -> Iterator[Callable[[Progress], None]]:
    """Yield the function that the runner calls with its progress."""
    heading = f"{what}: {length_s:g} s of robot time"
    with _view(console, what, length_s, f"{what}: starting", heading) as (show, every_s):
        due_s = now_s() + every_s if every_s == LINE_EVERY_S else now_s()
        waiting = held = False
        time_left = TimeLeft(length_s, LEAST_SHARE * length_s)

        def tell(progress: Progress) -> None:
            nonlocal due_s, waiting, held
            begins = (bool(progress.waits_for) and not waiting) or (progress.held and not held)     # shown at once
            waiting, held = bool(progress.waits_for), progress.held
            left = time_left.at(progress.now_ns * 1e-9, progress.wall_s)
            if held:
                time_left.forget()
            if begins or now_s() >= due_s or progress.now_ns >= progress.end_ns:
                show(length_s * progress.prepared if progress.preparing else progress.now_ns * 1e-9,
                     figures(progress, "" if held else left))
                due_s = now_s() + every_s

        yield tell


@contextmanager
def counting_view(console: Console, what: str, total: int, now_s: Callable[[], float] = time.monotonic, *,
                  at_most: bool = False) -> Iterator[Count]:
    """Yield the function that the caller calls after each of `total` runs, and with 0 when the first ones begin.

    With `at_most` the caller may end after fewer than `total` runs, so the view shows no time left.
    """
    with _view(console, what, total, what) as (show, every_s):
        done, due_s, soon_s = 0, now_s() + every_s, now_s() + min(SOON_S, every_s - BAR_EVERY_S)
        time_left, estimated = TimeLeft(total, 1), False

        def tell(more: int = 1) -> None:
            nonlocal done, due_s, estimated
            done += more
            left = "" if at_most else time_left.at(done, now_s())
            news = done <= 1 or (left and not estimated)
            if not more or now_s() >= due_s or (news and now_s() >= soon_s):
                estimated = bool(left)
                show(done, f"{done} of {'at most ' if at_most else ''}{total} runs" + (f", {left}" if left else ""))
                due_s = now_s() + every_s

        yield tell


@contextmanager
def campaign_view(console: Console, what: str,
                  now_s: Callable[[], float] = time.monotonic) -> Iterator[Callable[[int, int, int], None]]:
    """Yield the function that a campaign calls with (runs that have ended, of how many, of which do not hold).

    The pace is that of the runs that ended since the first call, as a campaign that is resumed begins with runs that
    took no time.
    """
    time_left: TimeLeft | None = None
    due_s = 0.0
    with _view(console, what, 1.0, f"{what}: checking the settings") as (show, every_s):
        def tell(ended: int, total: int, broken: int) -> None:
            nonlocal time_left, due_s
            if time_left is None:
                time_left, due_s = TimeLeft(total, 1), now_s() + every_s
                time_left.at(ended, now_s())
            elif now_s() >= due_s or ended == total:
                left = time_left.at(ended, now_s())
                show(ended / total, f"{ended} of {total} runs" + (f", {left}" if left else "") +
                     (f", {broken} do not hold" if broken else ""))
                due_s = now_s() + every_s

        yield tell


def figures(progress: Progress, left: str = "") -> str:
    """Return robot time, real-time factor, wall time left and frames by fate in one line.

    Before the start it is what a program prepares; while nodes do not answer, who they are.
    """
    if progress.preparing:
        return f"prepares {progress.preparing}"
    if progress.waits_for:
        return f"waits for {_some(progress.waits_for)}: no answer for {progress.waited_s:.0f} s"
    time_s = f"{progress.now_ns * 1e-9:.2f} of {progress.end_ns * 1e-9:.2f} s"
    return "  ".join(filter(None, (time_s, f"{progress.real_time_factor:.1f} x real time", left,
                                   by_fate(progress.frames))))


def _some(names: Sequence[str]) -> str:
    shown = ", ".join(names[:MOST_NAMES])
    return f"{shown} and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else shown


@contextmanager
def _view(console: Console, what: str, total: float, starting: str,
          heading: str = "") -> Iterator[tuple[Callable[[float, str], None], float]]:
    """Yield the function that shows how much of `total` is done, with figures, and the time between two calls [s].

    `starting` is the bar's text before the first call, `heading` the first line where there is no terminal.
    """
    if isinstance(console, PlainConsole) or not console.is_terminal:
        if heading:
            console.print(heading, soft_wrap=True)
        yield lambda done, text: console.print(f"{what}: {text}", soft_wrap=True), LINE_EVERY_S
        return
    from rich.progress import BarColumn, TextColumn  # late: a pipe needs no bar
    from rich.progress import Progress as Bar

    with Bar(TextColumn("{task.description}", markup=False), BarColumn(bar_width=24),
             TextColumn("{task.fields[figures]}", markup=False), console=console, auto_refresh=False,
             transient=True) as bar:
        task = bar.add_task(starting, total=total, figures="")

        def draw(done: float, text: str) -> None:
            bar.update(task, description=what, completed=done, figures=text)
            bar.refresh()

        bar.refresh()
        yield draw, BAR_EVERY_S
