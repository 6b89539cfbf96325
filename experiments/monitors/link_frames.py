"""The frames of chosen links, one row a frame however many copies it has, as arrays sorted by (link, number)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import polars as pl
from numpy.typing import NDArray

from experiments.link_metrics import DELIVERED, LINK

Ints = NDArray[np.int64]
NEVER_NS = np.iinfo(np.int64).max
UNFINISHED = "unfinished"


@dataclass(frozen=True)
class LinkFrames:
    """`link` is the place in the list of links."""

    link: Ints
    number: Ints
    offered_ns: Ints
    ended_ns: Ints                  # first instant after the frame on the air; where it never was, `offered_ns`
    delivered_ns: Ints              # of the first copy that reached the node; NEVER_NS: none did
    unfinished: NDArray[np.bool_]   # not delivered, and a copy was still under way when the run ended
    rows: pl.DataFrame              # fate and cause of the original copy of each frame

    @cached_property
    def endings(self) -> list[tuple[str, str]]:
        """Fate and cause of each frame's original copy, as text."""
        return list(zip(self.rows["fate"].to_list(), self.rows["cause"].to_list(), strict=True))


def link_frames(ledger: pl.DataFrame, links: Sequence[Sequence[str]]) -> LinkFrames:
    columns = ("number", "copy", "offered_ns", "end_ns", "delivered_ns", "fate", "cause")
    rows = numbered(ledger, LINK, links, *columns).sort("subject", "number", "copy")
    link, number = (rows[name].to_numpy() for name in ("subject", "number"))
    first = np.flatnonzero(new_group(link, number))
    offered_ns = rows["offered_ns"].to_numpy()[first]
    end_ns = rows["end_ns"].to_numpy()[first]
    heard = (rows["fate"] == DELIVERED).to_numpy()
    arrivals = np.where(heard, rows["delivered_ns"].to_numpy(), NEVER_NS)
    under_way = (rows["fate"] == UNFINISHED).to_numpy()
    delivered_ns = np.minimum.reduceat(arrivals, first) if first.size else arrivals
    pending = np.logical_or.reduceat(under_way, first) if first.size else under_way
    return LinkFrames(link[first], number[first], offered_ns, np.where(end_ns >= 0, end_ns, offered_ns), delivered_ns,
                      pending & (delivered_ns == NEVER_NS), rows.select("fate", "cause")[first])


def numbered(ledger: pl.DataFrame, names: Sequence[str], subjects: Sequence[Sequence[str]],
             *columns: str) -> pl.DataFrame:
    """The rows of the ledger that belong to one of `subjects`, with its place among them in the column `subject`."""
    known = pl.DataFrame({name: [subject[k] for subject in subjects] for k, name in enumerate(names)}
                         | {"subject": range(len(subjects))},
                         schema={**dict.fromkeys(names, pl.String), "subject": pl.Int64})
    return ledger.select(pl.col(names).cast(pl.String), *columns).join(known, on=list(names), how="inner")


def new_group(*columns: Ints) -> NDArray[np.bool_]:
    """Where a row differs from the one before it in any column; the first row does."""
    starts = np.zeros(columns[0].size, dtype=np.bool_)
    starts[:1] = True
    for column in columns:
        starts[1:] |= column[1:] != column[:-1]
    return starts
