"""Entries of `[[impairments]]` that a program makes: frames that are lost by number, and one that does nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def losing(on: str, lost: Sequence[int], every: int | None = None) -> dict[str, Any]:
    """Return an entry that loses these frames of each link that `on` selects, again after `every` frames."""
    return {"on": on, "kind": "scripted_loss", "lose_frames": list(lost)} | ({} if every is None else {"every": every})


def without_effect(on: str) -> dict[str, Any]:
    """Return an entry that passes every copy, to hold the place of another one in the list."""
    return {"on": on, "kind": "bernoulli_loss", "loss_ratio": 0.0}
