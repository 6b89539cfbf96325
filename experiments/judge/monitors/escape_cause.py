"""Explains why a target left the view: what its observers knew of it, and which frames were lost or late meanwhile.

    companion saw it last at 3.22 s, told at 3.25 s; since 2.1 s view: evader -> companion: frames 40, 43 lost
    (impairments[0] bernoulli_loss), slowest 0.3 s (radio: base -> drive)

The frames counted are those from and to an observer, the body that carries its camera, and the modems at the other ends
of their lines, offered since the target was last in the inner half of the field of view; of the frames of cameras only
those that show this target.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from experiments.judge.frame_copies import DELIVERED, FrameCopies
from experiments.judge.monitors.frames_in_words import frames_in_words
from experiments.judge.monitors.link_frames import LinkFrames, link_frames
from experiments.judge.monitors.outcome import seconds
from experiments.judge.monitors.records import Records
from experiments.scenario.subjects import Subject
from netem.core.fate import Fate
from netem.core.link_name import LinkName

NOT_SEEN = tuple(fate.value for fate in Fate if fate.unseen)
MOST_LINKS = 3                  # that are named, those that lost most


def cause(observers: Sequence[Subject], records: Records, since_ns: int, at_ns: int) -> str:
    """The explanation for a target that left the view at `at_ns`, by the frames offered since `since_ns`."""
    known = records.ledger.taken(records.ledger.ints("offered_ns") <= at_ns)
    told = "; ".join(_knowledge(subject, known, at_ns) for subject in observers)
    target = observers[0][1]
    nodes = {node for medium, _, observer in observers
             for node in (observer, records.camera(medium, observer).carrier or observer)} - {target}
    nodes = _with_their_modems(nodes, [link for link in records.ledger.link.names if link[0] not in records.sights])
    recent = known.taken((known.ints("offered_ns") >= since_ns) & ~known.fate.among(*NOT_SEEN))
    links = [(medium, sender, receiver) for medium, sender, receiver in recent.link.used()
             if not nodes.isdisjoint((sender, receiver)) and (medium not in records.sights or sender == target)]
    ways = ", ".join(_ways(link_frames(recent, links), links, at_ns))
    return f"{told}; since {seconds(since_ns)} {ways or 'nothing was lost or on its way'}"


def _with_their_modems(nodes: set[str], links: Iterable[LinkName]) -> set[str]:
    """Return `nodes` with every node that shares a medium of two nodes with one of them."""
    ends: dict[str, set[str]] = {}
    for medium, sender, receiver in links:
        ends.setdefault(medium, set()).update((sender, receiver))
    return nodes.union(*(pair for pair in ends.values() if len(pair) == 2 and not nodes.isdisjoint(pair)))


def _knowledge(subject: Subject, known: FrameCopies, at_ns: int) -> str:
    medium, target, observer = subject
    seen = known.only(medium=medium, sender=target, receiver=observer, fate=DELIVERED)
    seen = seen.taken(seen.ints("delivered_ns") <= at_ns)
    if not len(seen):
        return f"{observer} has never seen it"
    last = int(seen.ints("offered_ns").argmax())
    offered_ns, delivered_ns = (int(seen.ints(name)[last]) for name in ("offered_ns", "delivered_ns"))
    return f"{observer} saw it last at {seconds(offered_ns)}, told at {seconds(delivered_ns)}"


def _ways(frames: LinkFrames, links: Sequence[tuple[str, ...]], at_ns: int) -> Iterator[str]:
    """Describe the frames lost or on their way on the links with most of them, and the slowest frame that arrived."""
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
                   unfinished=frames.unfinished[rows], fate=frames.fate[rows], cause=frames.cause[rows])
