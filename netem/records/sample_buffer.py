"""The samples that are not in the file of signals yet: a file of its own, as it is called often and is compiled."""

from __future__ import annotations

from collections.abc import Callable, Sequence


class Topic:
    """The signals of one node; the first `kept` samples are in the journal."""

    def __init__(self, channel: int, names: tuple[str, ...]) -> None:
        self.channel = channel
        self.names = names
        self.samples: list[tuple[int, tuple[float, ...]]] = []
        self.kept = 0


class SampleBuffer:
    """Holds the samples by node, and calls `full` whenever there are `most` of them."""

    def __init__(self, most: int, full: Callable[[], object]) -> None:
        self.topics: dict[str, Topic] = {}
        self._most, self._full, self._held = most, full, 0

    def append(self, node: str, time_ns: int, values: Sequence[float]) -> None:
        """Add a value for each signal of `node`, in the order declared; times of one node never decrease.

        Raises ValueError for another number of values.
        """
        topic = self.topics[node]
        if len(values) != len(topic.names):
            raise ValueError(f"node {node!r} at {time_ns} ns: {len(values)} values for the {len(topic.names)} signals "
                             f"{list(topic.names)}")
        topic.samples.append((time_ns, tuple(values)))
        self._held += 1
        if self._held >= self._most:
            self._full()

    def clear(self) -> None:
        """Forget the samples, which are in the file."""
        for topic in self.topics.values():
            topic.samples.clear()
            topic.kept = 0
        self._held = 0
