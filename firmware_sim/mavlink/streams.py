"""Streams, messages sent periodically: an interval for each, and a budget for all.

Due times are multiples of the interval since it was set, so they do not drift; a message that could not be sent in time
is left out. If several are due, the one that has waited longest is first, so a budget that is too small slows all down
and starves none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

SECOND_NS: Final = 1_000_000_000


@dataclass
class Stream:
    interval_ns: int
    due_ns: int


class Streams:
    def __init__(self, defaults_ns: Mapping[str, int]) -> None:
        self.defaults_ns = defaults_ns      # by message, its interval
        self._streams = {name: Stream(interval_ns, 0) for name, interval_ns in defaults_ns.items()}

    def interval_ns(self, name: str) -> int:
        """Return the interval of a message; 0: it is not streamed."""
        stream = self._streams.get(name)
        return 0 if stream is None else stream.interval_ns

    def set_interval(self, name: str, interval_ns: int | None, now_ns: int) -> None:
        """Set the interval of a message; None: to the default, 0: stop the stream."""
        if interval_ns is None:
            interval_ns = self.defaults_ns.get(name, 0)
        if interval_ns:
            self._streams[name] = Stream(interval_ns, now_ns)
        else:
            self._streams.pop(name, None)

    def restart(self, now_ns: int) -> None:
        """Make all streams due, after the clock was set back to `now_ns`."""
        for stream in self._streams.values():
            stream.due_ns = now_ns

    def due(self, now_ns: int) -> list[str]:
        """Return the messages due at `now_ns`, the longest waiting first."""
        found = [(stream.due_ns, name) for name, stream in self._streams.items() if stream.due_ns <= now_ns]
        return [name for _, name in sorted(found)]

    def done(self, name: str, now_ns: int) -> None:
        """Note that a message was sent, or has no content now; set its next due time."""
        stream = self._streams[name]
        stream.due_ns += ((now_ns - stream.due_ns) // stream.interval_ns + 1) * stream.interval_ns


class Budget:
    """A token bucket: urgent messages are sent and charged at once, others wait until there is credit."""

    def __init__(self, bytes_per_s: int, burst_bytes: int = 300) -> None:
        self.bytes_per_s = bytes_per_s      # 0: no limit
        self.burst_bytes = burst_bytes      # largest credit
        self._credit = 0.0
        self._filled_ns = 0

    def credit(self, now_ns: int) -> bool:
        if not self.bytes_per_s:
            return True
        self._credit = min(float(self.burst_bytes),
                           self._credit + max(0, now_ns - self._filled_ns) * self.bytes_per_s / SECOND_NS)
        self._filled_ns = now_ns
        return self._credit > 0

    def charge(self, size: int) -> None:
        self._credit -= size
