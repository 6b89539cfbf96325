"""The frames that entered each link of a run, in the order in which `scripted_loss` numbers them.

A frame enters a link when its receiver has decoded it. What a medium ended before, as a collision, did not enter. A
frame of which a receiver decoded several copies, as a CAN bus may repeat one, is counted once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple

from experiments.judge.run_files import LEDGER
from experiments.scenario.model import Scenario
from netem.core.fate import Fate
from netem.core.link_name import LinkName
from netem.records.ledger_file import read_ledger

COLUMNS: Final = ("medium", "sender", "receiver", "number", "copy", "end_ns", "delivered_ns", "fate", "cause")

AT_THE_NODE: Final = (Fate.RECEIVER_GONE.value, Fate.RECEIVER_PAUSED.value)
UNDER_WAY: Final = "under way"          # the cause of a copy that the end of the run met behind its link


class LinkFrame(NamedTuple):
    """`cause` is what ended it on the link, "" if nothing did; `lost` tells whether its fate is LOST."""

    end_ns: int
    number: int             # of its sender
    cause: str
    lost: bool


def link_frames(folder: Path, scenario: Scenario) -> dict[LinkName, list[LinkFrame]]:
    """Return the frames of each link by the ledger in `folder`; raises OSError or ArrowException without one."""
    on_links = {spec.cause for spec in scenario.impairments} | {"checksum"}
    on_links |= {spec.cause for spec in scenario.faults}
    table = read_ledger(folder / LEDGER).select(list(COLUMNS))
    found: dict[LinkName, list[LinkFrame]] = {}
    for medium, sender, receiver, number, copy, end_ns, delivered_ns, fate, cause in zip(
            *(table[name].to_pylist() for name in COLUMNS), strict=True):
        if copy == 0 and (delivered_ns >= 0 or fate in AT_THE_NODE or cause in on_links or cause == UNDER_WAY):
            found.setdefault((medium, sender, receiver), []).append(
                LinkFrame(end_ns, number, cause, fate == Fate.LOST.value))
    return {link: sorted(frames) for link, frames in found.items()}
