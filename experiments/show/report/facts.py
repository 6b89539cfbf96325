"""The facts at the head of the report: the run, how it ended, and the reason if it failed."""

from __future__ import annotations

from typing import Any, NamedTuple

from experiments.judge.run_data import RunData
from experiments.judge.run_result import lateness_in_words


class Failure(NamedTuple):
    words: str
    last_report: str        # last report of the node that failed; "" if unknown or contained in the words


def failure_of(data: RunData) -> Failure | None:
    """Return the reason of a failed run, from summary.json or else run.json; None if the run did not fail."""
    words = data.summary.get("failure") or data.run.get("failure")
    if not words:
        return None
    last_report = data.summary.get("last_report") or ""
    return Failure(str(words), "" if last_report in words else str(last_report))


def windows(data: RunData) -> dict[str, str]:
    """Return the part of the run that an expectation judges, "[2, 4) s", for each that judges a part."""
    return {key: f"[{', '.join(f'{time_ns * 1e-9:g}' for time_ns in bound['during_ns'])}) s"
            for key, bound in (data.scenario.get("expect") or {}).items() if bound.get("during_ns")}


def unfinished(data: RunData) -> str:
    meant = data.scenario.get("length_ns")
    if ended := data.run.get("ended"):
        return f"The run ended {ended}; all figures are up to there."
    if isinstance(meant, int) and data.length_ns < meant:
        return f"The run was broken off at {seconds(data.length_ns)} of {seconds(meant)}; all figures are up to there."
    if not data.summary and data.scenario:
        return "The run left no summary: it was broken off, or is still going on."
    return ""


def facts(data: RunData) -> list[tuple[str, str]]:
    """Return (label, text) of the known facts that identify the run and its end."""
    summary, run = data.summary, data.run
    shown: list[tuple[str, Any]] = [
        ("Seed", data.scenario.get("seed", summary.get("seed"))),
        ("Length", seconds(data.length_ns)),
        ("Host", summary.get("host")),
        ("Real-time factor", _times(summary.get("real_time_factor"))),
        ("Lateness", lateness_in_words(run["real_time"]) if run.get("real_time") else None),
        ("Wall clock", f"{summary['wall_s']:.2f} s" if summary.get("wall_s") else None),
        ("Windows", summary.get("windows")),
        ("Grants", summary.get("grants")),
        ("Frame copies", f"{len(data.ledger):,}".replace(",", " ")),
        ("Ledger hash", data.ledger_metadata.get("hash")),
        ("Versions", ", ".join(f"{name} {text}" for name, text in (run.get("versions") or {}).items())),
    ]
    return [(label, str(value)) for label, value in shown if value not in (None, "")]


def _times(factor: float | None) -> str | None:
    return f"{factor:.1f} x real time" if factor else None


def milliseconds(time_ns: int) -> str:
    """Return an instant in s, rounded to 1 ms."""
    return f"{time_ns * 1e-9:.3f} s"


def seconds(time_ns: int) -> str:
    return f"{time_ns * 1e-9:.9f}".rstrip("0").rstrip(".") + " s"
