"""Why a target got out of view, in words: what its observers knew of it, and what did not get through meanwhile.

    companion saw it last at 3.22 s, told at 3.25 s; since 2.1 s view: evader -> companion: frames 40, 43 lost
    (impairments[0] bernoulli_loss), slowest 0.3 s (radio: base -> drive)

Counted are the frames from and to an observer and the body that carries it, and the modems at the other ends of their
lines, handed out since the target was last in the inner half of the field of view; those of cameras only where they
show this target.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import polars as pl

from experiments.link_metrics import DELIVERED, LINK
from experiments.monitors import Subject
from experiments.monitors.frames_in_words import frames_in_words
from experiments.monitors.link_frames import LinkFrames, link_frames
from experiments.monitors.outcome import seconds
from experiments.monitors.records import Records
from netem.fate import Fate

NOT_SEEN = (Fate.OUT_OF_VIEW.value, Fate.OCCLUDED.value)     # these looks got through: nothing was there
MOST_LINKS = 3                  # that are named, those that lost most


def cause(observers: Sequence[Subject], records: Records, since_ns: int, at_ns: int) -> str:
    """As it stood at `at_ns`."""
    ledger = records.ledger.filter(pl.col("offered_ns") <= at_ns)
    told = "; ".join(_knowledge(subject, ledger, at_ns) for subject in observers)
    target = observers[0][1]
    nodes = {node for medium, _, observer in observers
             for node in (observer, records.sensing[medium].cameras.get(observer, observer))} - {target}
    cameras = pl.col("medium").cast(pl.String).is_in(list(records.sensing))
    nodes = _with_their_modems(nodes, records.ledger.filter(~cameras))
    involved = ledger.filter(pl.col("offered_ns") >= since_ns).with_columns(pl.col(LINK).cast(pl.String)).filter(
        pl.col("sender").is_in(nodes) | pl.col("receiver").is_in(nodes)).filter(
        ~pl.col("medium").is_in(list(records.sensing)) | (pl.col("sender") == target)).filter(
        ~pl.col("fate").cast(pl.String).is_in(NOT_SEEN))
    links = involved.select(LINK).unique().sort(LINK).rows()
    ways = ", ".join(_ways(link_frames(involved, links), links, at_ns))
    return f"{told}; since {seconds(since_ns)} {ways or 'nothing was lost or on its way'}"


def _with_their_modems(nodes: set[str], ledger: pl.DataFrame) -> set[str]:
    """And who is alone with one of them on a medium."""
    ends = ledger.select(pl.col("medium", "sender", "receiver").cast(pl.String)).unique().group_by("medium").agg(
        pl.concat_list("sender", "receiver").list.explode().unique())["sender"].to_list()
    return nodes.union(*(pair for pair in ends if len(pair) == 2 and not nodes.isdisjoint(pair)))


def _knowledge(subject: Subject, ledger: pl.DataFrame, at_ns: int) -> str:
    medium, target, observer = subject
    seen = ledger.filter((pl.col("medium") == medium) & (pl.col("sender") == target) & (pl.col("receiver") == observer)
                         & (pl.col("fate") == DELIVERED) & (pl.col("delivered_ns") <= at_ns)).sort("offered_ns")
    if seen.is_empty():
        return f"{observer} has never seen it"
    return (f"{observer} saw it last at {seconds(seen['offered_ns'][-1])}, told at {seconds(seen['delivered_ns'][-1])}")


def _ways(frames: LinkFrames, links: Sequence[tuple[str, ...]], at_ns: int) -> Iterator[str]:
    """What is lost or on its way on the links with most of it, and the slowest of what has arrived."""
    missing = np.flatnonzero(frames.delivered_ns > at_ns)
    counts = np.bincount(frames.link[missing], minlength=len(links))
    for link in np.argsort(-counts, kind="stable")[:MOST_LINKS].tolist():
        rows = missing[frames.link[missing] == link]
        if rows.size:
            medium, sender, receiver = links[link]
            yield f"{medium}: {sender} -> {receiver}: {frames_in_words(_only(frames, rows), 0, rows.size, at_ns)}"
    arrived = np.flatnonzero(frames.delivered_ns <= at_ns)
    if arrived.size:
        slowest = int(arrived[int((frames.delivered_ns - frames.offered_ns)[arrived].argmax())])
        medium, sender, receiver = links[int(frames.link[slowest])]
        way_ns = int(frames.delivered_ns[slowest] - frames.offered_ns[slowest])
        yield f"slowest {seconds(way_ns)} ({medium}: {sender} -> {receiver})"


def _only(frames: LinkFrames, rows: np.ndarray[tuple[int], np.dtype[np.int64]]) -> LinkFrames:
    return replace(frames, link=frames.link[rows], number=frames.number[rows], offered_ns=frames.offered_ns[rows],
                   ended_ns=frames.ended_ns[rows], delivered_ns=frames.delivered_ns[rows],
                   unfinished=frames.unfinished[rows], rows=frames.rows[rows])
