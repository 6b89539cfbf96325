"""Whole games for tests: play one, and read what its records tell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import find, load

GAMES: dict[tuple[object, ...], tuple[Path, Any]] = {}      # (folder, summary) of what this test process has played


def played(out: Path, name: str, *overrides: str, seed: int | None = None, host: Any = "inline") -> tuple[RunData, Any]:
    """Return the records and the summary of a game of the library, with its folder at `out`.

    A game is played once in a test process; a test that asks for it again gets a link to its folder.
    """
    key = (name, overrides, seed, host)
    if key in GAMES:
        out.symlink_to(GAMES[key][0])
    else:
        scenario = load(find(name), seed=seed, overrides=overrides)
        GAMES[key] = out, run(scenario, host=host, out=out, report=False).summary
    return load_run(out), GAMES[key][1]


def counted(data: RunData, counter: str) -> int:
    return sum(counters.get(counter, 0) for counters in data.counters.values())


def told(data: RunData, kind: str, start: str = "") -> list[tuple[str, int, str]]:
    """Return node, instant [ns] and detail of each event of a kind whose detail begins with `start`."""
    return [(event.node, event.time_ns, event.detail) for event in data.events
            if event.kind == kind and event.detail.startswith(start)]
