"""Marks a union of settings classes whose members differ in the value of one key, without importing pydantic.

    TopologySettings = Annotated[FixedGraph | PathLoss, ToldApartBy("kind")]
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ToldApartBy:
    key: str
