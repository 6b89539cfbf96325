"""Who heard whom and who saw whom, and when, from the ledger of a run."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from agents.hybrid.network import Contacts, Pair
from experiments.judge.frame_copies import FrameCopies


def contacts_of(copies: FrameCopies, showing: Collection[str]) -> Contacts:
    """Return the arrivals of delivered copies by (sender, receiver); on the media `showing` they are sights."""
    arrived = copies.taken(copies.delivered)
    instants = arrived.ints("delivered_ns")
    heard: dict[Pair, NDArray[np.int64]] = {}
    seen: dict[Pair, NDArray[np.int64]] = {}
    for code, (medium, sender, receiver) in enumerate(arrived.link.names):
        of = seen if medium in showing else heard
        found = instants[arrived.link.codes == code]
        if found.size:
            pair = sender, receiver
            of[pair] = np.sort(np.concatenate([of[pair], found]) if pair in of else found)
    return Contacts(heard, seen)
