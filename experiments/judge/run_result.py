"""The progress of a run, and its result. `Summary` is `summary.json` in the run's folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from experiments.judge.monitors.outcome import Standing, seconds
from experiments.scenario.counted import counted
from experiments.scenario.fate_keys import in_words


class Progress(msgspec.Struct, frozen=True):
    """The progress of a run. `frames` counts the copies whose fate is settled, by fate."""

    now_ns: int
    end_ns: int
    wall_s: float
    windows: int
    frames: Mapping[str, int]
    waits_for: Sequence[str] = ()       # nodes that have not answered for `waited_s`
    waited_s: float = 0.0
    preparing: str = ""                 # before the start: what a program prepares, with the steps done
    prepared: float = 0.0               # share of its steps that are done
    held: bool = False                  # by a view, at a pause or at a speed that was chosen

    @property
    def real_time_factor(self) -> float:
        """Simulated time per wall time; above 1 is faster than real time."""
        return self.now_ns * 1e-9 / self.wall_s if self.wall_s > 0 else 0.0


def by_fate(frames: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {in_words(fate)}" for fate, count in frames.items() if count) or "no frames yet"


class Verdict(msgspec.Struct, frozen=True):
    """The verdict on one line of `[expect]`. `value` is None if the run has no such figure.

    A line with a `share` is judged over the runs of a campaign: it holds in every single run, also in one that is
    `beyond` its bound.
    """

    key: str
    value: float | None
    min: float | None
    max: float | None
    holds: bool
    why: str = ""               # reason why it has no value, "" if that is unknown
    formula: str = ""           # of which `value` is the robustness; "" for a figure
    unit: str = ""              # of that robustness
    at_ns: int | None = None    # the instant that decides it
    predicate: str = ""         # the comparison that decides it
    subject: str = ""           # the link or signal that counts there, if the comparison is about several
    share: float | None = None
    beyond: bool = False        # only with a share

    @property
    def kept(self) -> bool:
        """Whether the run keeps the bound."""
        return self.holds and not self.beyond

    def by_how_much(self) -> str:
        """The reason why the run does not keep the bound, "" if it does."""
        if self.kept:
            return ""
        if self.value is None:
            return self.why or "the run has no such figure"
        if self.formula and self.min is None and self.max is None:
            return f"violated by {abs(self.value):.6g}{f' {self.unit}' if self.unit else ''}, {self.decided()}"
        if self.min is not None and self.value < self.min:
            return f"{self.min - self.value:.6g} below the least allowed, {self.min:.6g}"
        if self.max is not None and self.value > self.max:
            return f"{self.value - self.max:.6g} above the most allowed, {self.max:.6g}"
        return "the run has nothing to measure it by"

    def decided(self) -> str:
        """The comparison that decides a formula, with its instant; "" for a figure, and for a formula without value."""
        if self.at_ns is None:
            return ""
        where = f", on {self.subject}" if self.subject else ""
        return f"decided at {seconds(self.at_ns)} by {self.predicate}{where}"


def rated(verdict: Verdict, share: float | None) -> Verdict:
    """Return the verdict on a single run of a line with `share`, or as it is without one."""
    if share is None:
        return verdict
    return msgspec.structs.replace(verdict, holds=True, beyond=not verdict.holds, share=share)


class Summary(msgspec.Struct, frozen=True):
    scenario: str
    question: str
    seed: int
    host: str
    length_ns: int
    wall_s: float               # from the first grant to the last report
    start_up_s: float           # from the command to the first grant
    real_time_factor: float
    windows: int
    grants: int
    ledger_hash: str
    frames: dict[str, int]      # copies by fate
    verdicts: list[Verdict]
    report: str | None          # path of report.html, relative to the run folder
    guarantees: list[Standing] = []
    replay: str = ""            # how much of an earlier run's fates this run has met
    warnings: list[str] = []    # mistakes of programs that end no run, such as frames that no medium carries
    code: str = ""              # "compiled", or "interpreted: " and the reason
    real_time: dict[str, Any] | None = None     # lateness in ns and its overruns, see `Pace.figures`
    ended: str = ""             # reason and instant of an early end without failure; the figures are up to there
    failure: str = ""           # the failure that ended the run, "" if none did
    last_report: str = ""       # of the node that failed, if a node did
    reached_ns: int | None = None
    processor_s: float = 0.0    # of the emulator's process, from the first grant to the finished ledger

    @property
    def holds(self) -> bool:
        return not self.failure and all(verdict.holds for verdict in self.verdicts)


def lateness_in_words(real_time: Mapping[str, Any]) -> str:
    """Describe the lateness of the deliveries, or without any of the instants, of a run in real time; its overruns."""
    deliveries, overruns = real_time.get("deliveries"), real_time["overruns"]
    late, of = (deliveries, "deliveries") if deliveries and deliveries["events"] else (real_time, "instants")
    return (f"{of}: median {late['median_ns'] * 1e-6:.3g} ms, 99 % {late['p99_ns'] * 1e-6:.3g} ms, worst "
            f"{late['worst_ns'] * 1e-6:.3g} ms; " + (counted(overruns, "overrun") if overruns else "no overrun"))


class RunResult(msgspec.Struct, frozen=True):
    folder: Path
    summary: Summary
