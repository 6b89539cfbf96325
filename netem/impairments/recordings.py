"""Keeps the recordings that impairments read from files, so that each file is read once for all links.

The builder of a scenario's impairments passes one `Recordings` to all of them.

Invariant: no impairment changes a recording that is kept, so links may share it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Value = TypeVar("Value")


class Recordings:
    def __init__(self) -> None:
        self._kept: dict[Hashable, Any] = {}

    def once(self, key: Hashable, read: Callable[[], Value]) -> Value:
        """Return the value of `key`, calling `read` for it the first time and again after an exception."""
        if key not in self._kept:
            self._kept[key] = read()
        value: Value = self._kept[key]
        return value
