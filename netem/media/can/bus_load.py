"""Bus load: the share of each window of time during which the bus was not idle; an intermission counts as busy.

    load_k = (busy time within [k w, (k + 1) w)) / w           1 when frame follows frame

`tell` receives the load of a window with the instant of its end.
"""

from __future__ import annotations

from collections.abc import Callable


class BusLoad:
    """The caller passes busy intervals in order and without overlap."""

    def __init__(self, window_ns: int) -> None:
        self.window_ns = window_ns
        self.total_ns = 0               # total length of the busy intervals
        self.next_ns = window_ns        # end of the current window
        self.tell: Callable[[int, float], None] = lambda time_ns, load: None
        self._told_ns = 0               # the part of the total that lies in finished windows
        self._busy_until_ns = 0         # end of the last busy interval

    def busy(self, start_ns: int, end_ns: int) -> None:
        if start_ns >= self.next_ns:
            self.idle_until(start_ns)
        self.total_ns += end_ns - start_ns
        self._busy_until_ns = end_ns

    def idle_until(self, time_ns: int) -> None:
        """Report every window that ends by `time_ns`; a busy interval that ends later counts up to the window's end."""
        while self.next_ns <= time_ns:
            busy_ns = self.total_ns - max(0, self._busy_until_ns - self.next_ns)
            self.tell(self.next_ns, (busy_ns - self._told_ns) / self.window_ns)
            self._told_ns = busy_ns
            self.next_ns += self.window_ns
