"""Names of the files in the folder of a run."""

from __future__ import annotations

from typing import Final

LOCK: Final = "run.lock"
RECORDS: Final = ("scenario.json", "ledger.parquet", "ledger_events.parquet", "signals.mcap", "run.json",
                  "guarantees.json", "summary.json", "report.html", "outputs.svg")
JOURNALS: Final = ("ledger.rows", "signals.rows")
