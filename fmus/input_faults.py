"""Faults of a plant's inputs: while one acts on an input, the FMU gets another value than the one that was set.

    set by the program --v--> changes, in the order in which they began: value, factor * v or v + bias --> FMU

Invariants:
- `asked` has, for each input that a fault changes, the value that was set last;
- an input that no fault changes reaches the FMU as it was set.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal

import msgspec


class Change(msgspec.Struct, frozen=True, array_like=True):
    how: Literal["value", "factor", "bias"]
    by: Any                             # a number for factor and bias

    def of(self, value: Any) -> Any:
        """Return what the FMU gets instead of `value`."""
        if self.how == "value":
            return self.by
        return value * self.by if self.how == "factor" else value + self.by


class InputFaults:
    def __init__(self, acting: dict[str, list[Change]] | None = None, asked: dict[str, Any] | None = None) -> None:
        self.acting = acting or {}
        self.asked = asked or {}

    def begin(self, name: str, change: Change, asked: Any) -> None:
        """Let `change` act on the input `name`; `asked` is the value that it has unless a fault acts already."""
        self.asked.setdefault(name, asked)
        self.acting.setdefault(name, []).append(change)

    def end(self, name: str, change: Change) -> Any:
        """End `change`; return the value that was set last."""
        acting, asked = self.acting[name], self.asked[name]
        acting.remove(change)
        if not acting:
            del self.acting[name], self.asked[name]
        return asked

    def of_values(self, names: tuple[str, ...], set_values: Callable[[Sequence[Any]], int],
                  ) -> Callable[[Sequence[Any]], int]:
        """Return `set_values`, which sets the variables `names`, so that faults change the values of its calls."""
        def changed(values: Sequence[Any]) -> int:
            acting = self.acting
            if acting.keys().isdisjoint(names) or len(values) != len(names):
                return set_values(values)
            given = list(values)
            for index, name in enumerate(names):
                for change in acting.get(name, ()):
                    given[index] = change.of(given[index])
            status = set_values(given)
            if status in (0, 1):
                self.asked |= {name: value for name, value in zip(names, values, strict=True) if name in acting}
            return status
        return changed
