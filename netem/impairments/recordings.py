"""Recordings that impairments have read from files: a file is read once, whatever the number of links.

The builder of the impairments of a scenario passes one `Recordings` to all of them, and drops it with them.

Invariant: content that is kept is never changed, so links may share it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Value = TypeVar("Value")


class Recordings:
    def __init__(self) -> None:
        self._kept: dict[Hashable, Any] = {}

    def once(self, key: Hashable, read: Callable[[], Value]) -> Value:
        """The value that `read` returned for this key. It is called once, and anew after an exception."""
        if key not in self._kept:
            self._kept[key] = read()
        value: Value = self._kept[key]
        return value
