"""Whole games for tests: play one, and read what its records tell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import find, load


def played(out: Path, name: str, *overrides: str, seed: int | None = None, host: Any = "inline") -> tuple[RunData, Any]:
    """Play a scenario of the library into `out`; return its records and its summary."""
    summary = run(load(find(name), seed=seed, overrides=overrides), host=host, out=out, report=False).summary
    return load_run(out), summary


def counted(data: RunData, counter: str) -> int:
    return sum(counters.get(counter, 0) for counters in data.counters.values())


def told(data: RunData, kind: str, start: str = "") -> list[tuple[str, int, str]]:
    """Return node, instant [ns] and detail of each event of a kind whose detail begins with `start`."""
    return [(event.node, event.time_ns, event.detail) for event in data.events
            if event.kind == kind and event.detail.startswith(start)]
