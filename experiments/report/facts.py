"""What the head of the report says: which run it is, how it went, and, where it failed, why."""

from __future__ import annotations

from typing import Any, NamedTuple

from experiments.run_data import RunData


class Failure(NamedTuple):
    words: str
    more: list[tuple[str, str]]         # what else the run told about it: (label, text)


FURTHER = {"last_report": "Last report of the node", "stack": "Where it hung", "traceback": "Traceback",
           "waiting_for": "Waited for"}


def failure_of(data: RunData) -> Failure | None:
    """Why the run ended before its time, as summary.json or run.json has it; None if it did not fail."""
    told = data.summary.get("failure") or data.run.get("failure")
    if not told:
        return None
    fields = dict(told) if isinstance(told, dict) else {"words": told}
    words = next((str(fields.pop(key)) for key in ("words", "message", "error") if fields.get(key)), "The run failed.")
    for key in FURTHER:
        if key not in fields and data.summary.get(key):
            fields[key] = data.summary[key]
    more = [(FURTHER.get(key, key.replace("_", " ").capitalize()), _as_text(value)) for key, value in fields.items()
            if value not in (None, "", [], {})]
    return Failure(words, more)


def _as_text(value: Any) -> str:
    if isinstance(value, dict):
        return "\n".join(f"{key}: {_as_text(part)}" for key, part in value.items())
    return "\n".join(map(_as_text, value)) if isinstance(value, list) else str(value)


def windows(data: RunData) -> dict[str, str]:
    """The part of the run that an expectation judges, "[2, 4) s", for those that judge a part."""
    return {key: f"[{', '.join(f'{time_ns * 1e-9:g}' for time_ns in bound['during_ns'])}) s"
            for key, bound in (data.scenario.get("expect") or {}).items() if bound.get("during_ns")}


def unfinished(data: RunData) -> str:
    meant = data.scenario.get("length_ns")
    if isinstance(meant, int) and data.length_ns < meant:
        return f"The run was broken off at {seconds(data.length_ns)} of {seconds(meant)}; all figures are up to there."
    if not data.summary and data.scenario:
        return "The run left no summary: it was broken off, or is still going on."
    return ""


def facts(data: RunData) -> list[tuple[str, str]]:
    """What identifies the run and how it went, as far as it is known."""
    summary, run = data.summary, data.run
    shown: list[tuple[str, Any]] = [
        ("Seed", data.scenario.get("seed", summary.get("seed"))),
        ("Length", seconds(data.length_ns)),
        ("Host", summary.get("host")),
        ("Real-time factor", _times(summary.get("real_time_factor"))),
        ("Wall clock", f"{summary['wall_s']:.2f} s" if summary.get("wall_s") else None),
        ("Windows", summary.get("windows")),
        ("Grants", summary.get("grants")),
        ("Frame copies", f"{data.ledger.height:,}".replace(",", " ")),
        ("Ledger hash", data.ledger_metadata.get("hash")),
        ("Versions", ", ".join(f"{name} {text}" for name, text in (run.get("versions") or {}).items())),
    ]
    return [(label, str(value)) for label, value in shown if value not in (None, "")]


def _times(factor: float | None) -> str | None:
    return f"{factor:.1f} x real time" if factor else None


def seconds(time_ns: int) -> str:
    return f"{time_ns * 1e-9:.9f}".rstrip("0").rstrip(".") + " s"
