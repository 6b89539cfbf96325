"""Shows the progress of a run: a bar on a terminal, a line every few seconds elsewhere.

The runner calls the view after windows and, from the thread that watches the nodes, while it waits for a node. The view
draws at most once every BAR_EVERY_S or LINE_EVERY_S.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from experiments.judge.run_result import Progress, by_fate
from experiments.show.console import PlainConsole

if TYPE_CHECKING:
    from rich.console import Console as RichConsole
    from rich.progress import Progress as Bar

    from experiments.show.console import Console

BAR_EVERY_S = 0.1
LINE_EVERY_S = 5.0
MOST_NAMES = 5          # most nodes named in the line about nodes that do not answer


@contextmanager
def live_view(console: Console, what: str, length_s: float,
              now_s: Callable[[], float] = time.monotonic) -> Iterator[Callable[[Progress], None]]:
    """Yield the function that the runner calls with its progress."""
    if not isinstance(console, PlainConsole) and console.is_terminal:
        with _bar(console) as bar:
            task = bar.add_task(f"{what}: starting", total=length_s, figures="")

            def draw(progress: Progress) -> None:
                bar.update(task, description=what, completed=progress.now_ns * 1e-9, figures=figures(progress))
                bar.refresh()

            bar.refresh()
            yield _throttled(draw, BAR_EVERY_S, now_s)
    else:
        console.print(f"{what}: {length_s:g} s of robot time", soft_wrap=True)
        yield _throttled(lambda progress: console.print(f"{what}: {figures(progress)}", soft_wrap=True),
                            LINE_EVERY_S, now_s)


@contextmanager
def counting_view(console: Console, what: str, total: int,
                  now_s: Callable[[], float] = time.monotonic) -> Iterator[Callable[[], None]]:
    """Yield the function that the caller calls after each of `total` runs."""
    done = 0

    def count(show: Callable[[], None], every_s: float) -> Callable[[], None]:
        due_s = now_s() + every_s

        def tell() -> None:
            nonlocal done, due_s
            done += 1
            if now_s() >= due_s:
                show()
                due_s = now_s() + every_s

        return tell

    if not isinstance(console, PlainConsole) and console.is_terminal:
        with _bar(console) as bar:
            task = bar.add_task(what, total=total, figures="")
            bar.refresh()

            def draw() -> None:
                bar.update(task, completed=done, figures=f"{done} of {total} runs")
                bar.refresh()

            yield count(draw, BAR_EVERY_S)
    else:
        yield count(lambda: console.print(f"{what}: {done} of {total} runs", soft_wrap=True), LINE_EVERY_S)


@contextmanager
def campaign_view(console: Console, what: str,
                  now_s: Callable[[], float] = time.monotonic) -> Iterator[Callable[[int, int, int], None]]:
    """Yield the function that a campaign calls with (runs that have ended, of how many, of which do not hold).

    The time left is that of the runs to come at the pace of those that ended since the first call, as a campaign that
    is resumed begins with runs that took no time.
    """
    begins: tuple[float, int] | None = None
    due_s = 0.0

    def told(ended: int, total: int, broken: int) -> str:
        assert begins is not None
        ran = ended - begins[1]
        left = f", {_duration((now_s() - begins[0]) * (total - ended) / ran)} left" if ran > 0 and ended < total else ""
        return f"{ended} of {total} runs{left}" + (f", {broken} do not hold" if broken else "")

    def count(show: Callable[[str, int, int], None], every_s: float) -> Callable[[int, int, int], None]:
        def tell(ended: int, total: int, broken: int) -> None:
            nonlocal begins, due_s
            if begins is None:
                begins, due_s = (now_s(), ended), now_s() + every_s
            elif now_s() >= due_s or ended == total:
                show(told(ended, total, broken), ended, total)
                due_s = now_s() + every_s

        return tell

    if not isinstance(console, PlainConsole) and console.is_terminal:
        with _bar(console) as bar:
            task = bar.add_task(f"{what}: checking the settings", total=None, figures="")
            bar.refresh()

            def draw(text: str, ended: int, total: int) -> None:
                bar.update(task, description=what, completed=ended, total=total, figures=text)
                bar.refresh()

            yield count(draw, BAR_EVERY_S)
    else:
        yield count(lambda text, ended, total: console.print(f"{what}: {text}", soft_wrap=True), LINE_EVERY_S)


def figures(progress: Progress) -> str:
    """Return robot time, real-time factor, wall time left and frames by fate in one line, or the nodes waited for."""
    if progress.waits_for:
        return f"waits for {_some(progress.waits_for)}: no answer for {progress.waited_s:.0f} s"
    time_s = f"{progress.now_ns * 1e-9:.2f} of {progress.end_ns * 1e-9:.2f} s"
    left_s = progress.left_s
    left = f"{_duration(left_s)} left  " if left_s else ""
    return f"{time_s}  {progress.real_time_factor:.1f} x real time  {left}{by_fate(progress.frames)}"


def _some(names: Sequence[str]) -> str:
    shown = ", ".join(names[:MOST_NAMES])
    return f"{shown} and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else shown


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min {rest} s" if minutes else \
        f"{rest} s"


def _bar(console: RichConsole) -> Bar:
    from rich.progress import BarColumn, TextColumn  # late: a pipe needs no bar
    from rich.progress import Progress as Bar

    return Bar(TextColumn("{task.description}", markup=False), BarColumn(bar_width=24),
               TextColumn("{task.fields[figures]}", markup=False), console=console, auto_refresh=False, transient=True)


def _throttled(show: Callable[[Progress], None], every_s: float,
                  now_s: Callable[[], float]) -> Callable[[Progress], None]:
    due_s = now_s() + every_s if every_s == LINE_EVERY_S else now_s()
    waiting = False

    def tell(progress: Progress) -> None:
        nonlocal due_s, waiting
        begins = bool(progress.waits_for) and not waiting       # shown at once
        waiting = bool(progress.waits_for)
        if begins or now_s() >= due_s or progress.now_ns >= progress.end_ns:
            show(progress)
            due_s = now_s() + every_s

    return tell
