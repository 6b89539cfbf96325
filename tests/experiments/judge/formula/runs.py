"""Runs in memory for judging formulas: signals as lists, frames of one link."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.judge.frame_copies import FrameCopies
from experiments.judge.run_data import RunData
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.ledger import Ledger, Row
from netem.records.signal_table import SignalTable

MS = 1_000_000
S = 1_000_000_000


def signals(node: str, unit: str = "1", every_ns: int = S, **columns: Sequence[float]) -> dict[str, SignalTable]:
    values = np.array(list(columns.values()), dtype=float).T
    return {node: SignalTable(node, tuple(columns), (unit,) * len(columns), np.arange(len(values)) * every_ns, values)}


def rows(*sent: tuple[int, Fate, int], medium: str = "radio", sender: str = "r1", receiver: str = "r2") -> list[Row]:
    """Frames of one link: (offered [ms], fate, delivered [ms], -1 if it was not), 1 ms on the air."""
    ledger = Ledger()
    for number, (at_ms, fate, delivered_ms) in enumerate(sent):
        ledger.expect(1, medium)
        ledger.close(Frame(medium, sender, number, at_ms * MS, b"x", on_air_ns=at_ms * MS, end_ns=(at_ms + 1) * MS),
                     receiver, fate, delivered_ns=delivered_ms * MS if delivered_ms >= 0 else -1)
    ledger.finish()
    return list(ledger.rows)


def frames(*sent: tuple[int, Fate, int], **link: str) -> FrameCopies:
    return FrameCopies.of_rows(rows(*sent, **link))


def run(length_ns: int, copies: FrameCopies | None = None, **more: Any) -> RunData:
    return RunData(length_ns, FrameCopies.of_rows([]) if copies is None else copies, **more)
