"""The outcome of one scenario in a call of `marconet run` or `marconet check`."""

from __future__ import annotations

from typing import Any

import msgspec

from experiments.judge.run_result import Summary


class ScenarioOutcome(msgspec.Struct, frozen=True):
    """`problems` are the lines printed as errors; `summary` and `folder` are those of a run that ended."""

    scenario: str
    source: str                             # as the user named it
    exit_code: int
    problems: list[str]
    folder: str | None = None
    summary: Summary | None = None
    resolved: dict[str, Any] | None = None  # after `check`: the scenario with every default filled in
