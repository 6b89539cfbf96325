"""Names of the files in the folder of a run."""

from __future__ import annotations

from typing import Final

LOCK: Final = "run.lock"
RECORDS: Final = ("scenario.json", "ledger.parquet", "run.json", "guarantees.json", "summary.json", "report.html",
                  "outputs.svg")            # beside the files of the recorders (netem/records/table.py)
JOURNALS: Final = ("ledger.rows", "signals.rows")
