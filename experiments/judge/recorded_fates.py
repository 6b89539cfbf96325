"""Reads the fate and the delay of every frame copy from the ledger of a run, link by link.

Another run repeats them (`marconet run --fates-of`), and trace files are made of them (`marconet export`).
"""

from __future__ import annotations

from pathlib import Path

from experiments.judge.run_files import LEDGER
from netem.core.fate import Fate
from netem.core.link_name import LinkName
from netem.media.replayed_links import RecordedCopy, RecordedFrame
from netem.records.ledger_file import read_ledger


def recorded_fates(folder: Path) -> dict[LinkName, list[RecordedFrame]]:
    """Return the frames of each link of the run in `folder`, in the order of their numbers.

    Raises FileNotFoundError if the folder has no ledger.
    """
    columns = ["medium", "sender", "receiver", "number", "copy", "offered_ns", "end_ns", "delivered_ns", "fate"]
    copies: dict[LinkName, dict[int, tuple[int, dict[int, RecordedCopy]]]] = {}
    table = read_ledger(folder / LEDGER).select(columns)
    for medium, sender, receiver, number, copy, offered_ns, end_ns, delivered_ns, fate in zip(
            *(table[name].to_pylist() for name in columns), strict=True):
        frames = copies.setdefault((medium, sender, receiver), {})
        _, found = frames.setdefault(number, (offered_ns, {}))
        found[copy] = RecordedCopy(Fate(fate), delivered_ns - end_ns if delivered_ns >= 0 else 0)
    return {link: [RecordedFrame(number, offered_ns, tuple(found[copy] for copy in sorted(found)))
                   for number, (offered_ns, found) in sorted(frames.items())] for link, frames in copies.items()}
