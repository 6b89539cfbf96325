"""Where a frame of one sender gets to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Reach:
    """Where a frame of one sender gets to.

    - `receivers`: the intended ones, of whose copies the ledger keeps account, in the order of the nodes;
    - `in_range`: who can decode it, senses it as a carrier, and loses what it overlaps under `radio_network`;
    - `too_weak`: the receivers that are not in range;
    - `rx_dbm`: the power at everyone who gets any, intended or not.
    """

    receivers: tuple[str, ...]
    in_range: frozenset[str]
    too_weak: frozenset[str]
    rx_dbm: Mapping[str, float]
