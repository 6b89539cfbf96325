"""`marconet break` and `marconet shrink`: read the options, show the progress, print what was found and its command."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from experiments.run.exits import ExitCode, errors_as_text
from experiments.scenario.counted import counted

if TYPE_CHECKING:
    from experiments.search.falsify import Found, Wanted
    from experiments.search.shrink import Shrunk
    from experiments.show.console import Console

MOST_LINES: Final = 20          # of a pattern that are printed


def run_break(console: Console, source: str, budgets: Sequence[str], minimize: str | None, maximize: str | None,
              vary: Sequence[str], *, verbose: bool, as_json: bool, runs: int, jobs: int | None, seed: int,
              duration_s: float | None, overrides: Sequence[str], out: Path | None) -> int:
    """Search and return the exit code of the command."""
    with errors_as_text(verbose):
        from experiments.scenario import find
        from experiments.search.base import Base
        from experiments.search.falsify import Wanted, falsify
        from experiments.search.objective import Objective
        from experiments.show.live_view import counting_view
        from experiments.sweep.vary import parse

        base = Base.of(find(source), overrides, {} if duration_s is None else {"length_s": duration_s})
        objective = Objective.of_either(minimize, maximize, base)
        wanted = Wanted(base, budgets, objective, runs, [parse(text) for text in vary], seed, jobs, out)
        try:
            with counting_view(console, f"break {base.scenario.name}", max(1, runs)) as progress:
                found = falsify(wanted, progress)
        except KeyboardInterrupt:
            if wanted.written is not None:
                print(f"the worst so far: {wanted.written}", file=sys.stderr)
            raise
        command = "" if found.file is None else _command(found.file)
        if as_json:
            from experiments.show.json_output import print_json

            print_json(_break_as_json(found, wanted, command))
        _print_break(console, found, wanted, command)
        for line in found.warnings:
            print(f"warning: {line}", file=sys.stderr)
        return ExitCode.NODE_FAILED if found.figures.failure else \
            ExitCode.DONE if found.figures.holds and not _violated(found, wanted) else ExitCode.EXPECTATION_BROKEN


def run_shrink(console: Console, run_dir: Path, *, verbose: bool, as_json: bool, runs: int, expectation: str,
               out: Path | None) -> int:
    """Make the cause of a failure smaller and return the exit code of the command."""
    with errors_as_text(verbose):
        from experiments.search.shrink import shrink
        from experiments.show.live_view import counting_view

        with counting_view(console, f"shrink {run_dir}", max(1, runs), at_most=True) as progress:
            shrunk = shrink(run_dir, runs, out, expectation, progress)
        if as_json:
            from experiments.show.json_output import print_json

            print_json(_shrink_as_json(shrunk))
        _print_shrink(console, shrunk)
        return ExitCode.DONE


def _command(file: Path) -> str:
    return shlex.join(["marconet", "run", str(file), "--host", "inline"])


def _violated(found: Found, wanted: Wanted) -> bool:
    """Return whether a formula that was not among the expectations is violated."""
    return isinstance(wanted.objective.entry, str) and not wanted.objective.largest and found.value < 0


def _print_break(console: Console, found: Found, wanted: Wanted, command: str) -> None:
    from experiments.show.text_views import print_path

    figures = found.figures
    if found.file is None:
        console.print(f"{wanted.objective.text}: {found.without:.6g} without losses and faults, and nothing worse in "
                      f"{counted(found.runs, 'run')} within the budget", soft_wrap=True)
        return
    if figures.failure:
        console.print(f"{wanted.objective.text}: the run fails: {figures.failure}", soft_wrap=True)
    else:
        console.print(f"{wanted.objective.text}: {found.value:.6g} at worst, {found.without:.6g} without losses and "
                      f"faults; found in run {found.number + 1} of {found.runs}", soft_wrap=True)
    _print_lines(console, found.lines)
    print_path(console, "scenario", found.file)
    console.print(command, soft_wrap=True)


def _print_lines(console: Console, lines: Sequence[str]) -> None:
    """Print the first lines about losses and faults, and how many more there are."""
    for line in lines[:MOST_LINES]:
        console.print(f"  {line}", soft_wrap=True)
    if len(lines) > MOST_LINES:
        console.print(f"  and {len(lines) - MOST_LINES} more, which are in the scenario", soft_wrap=True)


def _print_shrink(console: Console, shrunk: Shrunk) -> None:
    from experiments.show.text_views import print_path

    what = f"expectation {shrunk.expectation}" if shrunk.expectation else "the run"
    kept = f"with {len(shrunk.kept)} of {len(shrunk.items)} faults, losses and other changes of frames" \
        if shrunk.kept else "without any fault, loss or other change of a frame"
    console.print(f"{what} still fails {kept}, in {shrunk.length_ns / 1e9:.9g} of {shrunk.full_length_ns / 1e9:.9g} s; "
                  f"{counted(shrunk.runs, 'run')}", soft_wrap=True)
    _print_lines(console, shrunk.lines)
    print_path(console, "scenario", shrunk.file)
    console.print(_command(shrunk.file), soft_wrap=True)
    if not shrunk.minimal:
        print(f"warning: not minimal: all {shrunk.runs} --runs were used up: shrink a run of this scenario further, or "
              "give more --runs", file=sys.stderr)


def _break_as_json(found: Found, wanted: Wanted, command: str) -> dict[str, object]:
    return {"scenario": found.file, "command": command, "figure": wanted.objective.text, "value": found.value,
            "without": found.without, "run": found.number, "runs": found.runs, "holds": found.figures.holds,
            "failure": found.figures.failure, "pattern": found.lines, "warnings": found.warnings}


def _shrink_as_json(shrunk: Shrunk) -> dict[str, object]:
    return {"scenario": shrunk.file, "command": _command(shrunk.file), "expectation": shrunk.expectation,
            "kept": shrunk.lines, "of": len(shrunk.items), "length_s": shrunk.length_ns / 1e9, "runs": shrunk.runs,
            "minimal": shrunk.minimal}
