"""The frames of selected links, one row per frame whatever its number of copies, as arrays sorted by (link, number)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.judge.frame_copies import Coded, FrameCopies
from experiments.judge.groups import Ints, new_group
from netem.core.fate import Fate
from netem.wire.instants import NEVER_NS


@dataclass(frozen=True)
class LinkFrames:
    """Columns of the frames; `link` is the index into the list of links."""

    link: Ints
    number: Ints
    offered_ns: Ints
    ended_ns: Ints                  # first instant after the transmission; `offered_ns` if there was none
    delivered_ns: Ints              # arrival of the first copy that was delivered, NEVER_NS if none was
    unfinished: NDArray[np.bool_]   # not delivered, and a copy was on its way when the run ended
    fate: Coded                     # fate and cause are those of the original copy of each frame
    cause: Coded


def link_frames(copies: FrameCopies, links: Sequence[Sequence[str]]) -> LinkFrames:
    subject, chosen = rows_of(copies.link, links)
    rows = copies.taken(chosen)
    number = rows.ints("number")
    order = np.lexsort((rows.ints("copy"), number, subject))
    first = np.flatnonzero(new_group(subject[order], number[order]))
    arrivals = np.where(rows.delivered, rows.ints("delivered_ns"), NEVER_NS)[order]
    under_way = rows.fate.among(Fate.UNFINISHED.value)[order]
    delivered_ns = np.minimum.reduceat(arrivals, first) if first.size else arrivals
    pending = np.logical_or.reduceat(under_way, first) if first.size else under_way
    original = order[first]
    offered_ns, end_ns = rows.ints("offered_ns")[original], rows.ints("end_ns")[original]
    return LinkFrames(subject[original], number[original], offered_ns, np.where(end_ns >= 0, end_ns, offered_ns),
                      delivered_ns, pending & (delivered_ns == NEVER_NS), rows.fate[original],
                      rows.coded("cause")[original])


def rows_of(column: Coded, subjects: Sequence[Sequence[str]]) -> tuple[Ints, Ints]:
    """Return (subject, row) of the rows that belong to one of `subjects`; a subject is the index into that list."""
    place = {tuple(subject): k for k, subject in enumerate(subjects)}
    of_name = np.array([place.get(name, -1) for name in column.names], dtype=np.int64)
    of_row = of_name[column.codes] if of_name.size else np.zeros(0, dtype=np.int64)
    chosen = np.flatnonzero(of_row >= 0)
    return of_row[chosen], chosen
