"""Marks a union of settings classes whose members are told apart by one key, without importing the reader of scenarios.

    TopologySettings = Annotated[FixedGraph | PathLoss, ToldApartBy("kind")]
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ToldApartBy:
    key: str
