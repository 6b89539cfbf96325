"""Finds frames that a program sent and its medium did not carry: too long, empty, or no frame of that medium."""

from __future__ import annotations

from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

from netem.core.fate import Fate

COLUMNS = ["medium", "sender", "number", "offered_ns", "size_bytes", "cause"]


def malformed_frames(ledger: Path) -> list[str]:
    """Return a line for each medium and cause: senders, number of frames, instant and length of the first frame."""
    table = pq.read_table(ledger, columns=[*COLUMNS, "fate"])
    table = table.filter(pc.equal(pc.cast(table["fate"], "string"), Fate.MALFORMED.value)).select(COLUMNS)
    found: dict[tuple[str, str], dict[tuple[str, int], tuple[int, int]]] = {}
    for medium, sender, number, offered_ns, size, cause in zip(*(table[name].to_pylist() for name in COLUMNS),
                                                                strict=True):
        found.setdefault((medium, cause), {})[sender, number] = offered_ns, size
    lines = []
    for (medium, cause), frames in found.items():
        first_ns, size = min(frames.values())
        senders = list(dict.fromkeys(sender for sender, _ in frames))
        who = senders[0] if len(senders) == 1 else f"{len(senders)} agents: {', '.join(senders)}:"
        count = f"{len(frames)} frames" if len(frames) > 1 else "a frame"
        lines.append(f"{medium}: {who} handed out {count} that nobody can receive: {cause} "
                     f"(the first at {first_ns * 1e-9:g} s has {size} bytes)")
    return lines
