"""Passes each sample of a run to those who record samples: a file of its own, as it is called often and is compiled."""

from __future__ import annotations

from collections.abc import Callable, Sequence


class Sampler:
    """`listeners` are called in their order with (node, time_ns, one value for each signal of the node)."""

    def __init__(self, listeners: Sequence[Callable[[str, int, Sequence[float]], None]]) -> None:
        self._listeners = tuple(listeners)

    def sample(self, node: str, time_ns: int, values: Sequence[float]) -> None:
        for tell in self._listeners:
            tell(node, time_ns, values)
