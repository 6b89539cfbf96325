"""Bus load: the share of each window of time during which the bus was not idle, intermissions counted as busy.

    load_k = (busy time within [k w, (k + 1) w)) / w           1 when frame follows frame

Told when the window is over, at its end.
"""

from __future__ import annotations

from collections.abc import Callable


class BusLoad:
    """Busy intervals come in order and do not overlap."""

    def __init__(self, window_ns: int) -> None:
        self.window_ns = window_ns
        self.total_ns = 0               # busy, of the intervals told
        self.next_ns = window_ns        # end of the present window
        self.tell: Callable[[int, float], None] = lambda time_ns, load: None
        self._told_ns = 0               # of the total, in windows that are over
        self._busy_until_ns = 0         # end of the last interval

    def busy(self, start_ns: int, end_ns: int) -> None:
        if start_ns >= self.next_ns:
            self.idle_until(start_ns)
        self.total_ns += end_ns - start_ns
        self._busy_until_ns = end_ns

    def idle_until(self, time_ns: int) -> None:
        """Tell every window that ends by `time_ns`; what is busy beyond comes later."""
        while self.next_ns <= time_ns:
            busy_ns = self.total_ns - max(0, self._busy_until_ns - self.next_ns)
            self.tell(self.next_ns, (busy_ns - self._told_ns) / self.window_ns)
            self._told_ns = busy_ns
            self.next_ns += self.window_ns
