"""How fast virtual time passes while a page of the view is open: at a speed, as fast as possible, or not at all.

    paced:  stop --conductor--> hold until the wall clock is there --> the next stop, PACED_S of the wall clock later
    free:   the conductor calls `poll` after windows, some ten times a second

`Steering` holds the run at stops of the conductor. At a stop, everything before its instant has happened and nothing
after it has, so that what the run does depends neither on the speed nor on a pause, and a fault can be injected there.
The run is held only while a page is open, and otherwise goes as fast as it can.
"""

from __future__ import annotations

import selectors
import time
from collections.abc import Callable
from typing import Any, Final

from netem.emulator.conductor import Conductor

PACED_S: Final = 0.02               # of the wall clock between two stops
MOST_BEHIND_S: Final = 0.2          # a run that is further behind its speed does not make up for it
LOOKS_EVERY_S: Final = 0.5          # longest wait for a message during a pause


class Steering:
    def __init__(self, conductor: Conductor, now_s: Callable[[], float] = time.monotonic) -> None:
        self.paused = False
        self.speed: float | None = 1.0              # virtual seconds a second of the wall clock; None: any
        self._conductor, self._now_s = conductor, now_s
        self._watched = False
        self._selector = selectors.DefaultSelector()
        self._stop_comes = False
        self._anchor: tuple[float, int] | None = None       # an instant of the wall clock [s] and of the run [ns]

    def attend(self, file: Any, call: Callable[[], None]) -> None:
        """Call `call` whenever the socket `file` can be read: at once while the run is held, else after a window."""
        self._selector.register(file, selectors.EVENT_READ, call)

    def leave(self, file: Any) -> None:
        """Stop watching `file`."""
        self._selector.unregister(file)

    def watched(self, pages: int) -> None:
        """Take the number of pages that are open."""
        self._watched, self._anchor = pages > 0, None

    def pause(self) -> None:
        self.paused = True

    def go(self) -> None:
        self.paused, self._anchor = False, None

    def choose(self, speed: float | None) -> None:
        self.speed, self._anchor = speed, None

    def await_page(self, within_s: float) -> bool:
        """Wait before the run until a page is open; return False if none is `within_s` later."""
        until_s = self._now_s() + within_s
        while not self._watched and (left_s := until_s - self._now_s()) > 0:
            self._attend_for(left_s)
        self.poll()
        return self._watched

    def poll(self) -> None:
        """Handle the messages that have arrived. The conductor calls this between two windows, or before the first."""
        self._attend_for(0)
        if self.holds and not self._stop_comes:
            self._stop_at(self._conductor.passed_ns)

    @property
    def holds(self) -> bool:
        """Whether a page is open, and the run paused there or at a speed."""
        return self._watched and (self.paused or self.speed is not None)

    def _stop_at(self, time_ns: int) -> None:
        self._stop_comes = True
        self._conductor.stop_at(time_ns, self._stop)

    def _stop(self) -> None:
        self._stop_comes = False
        now_ns = self._conductor.stop_ns
        while (left_s := self._left_s(now_ns)) > 0:
            self._attend_for(left_s)
        self._attend_for(0)
        if self.holds:
            self._stop_at(now_ns + (max(1, round(self.speed * PACED_S * 1e9)) if self.speed and not self.paused else 0))

    def _left_s(self, now_ns: int) -> float:
        """Return how long the run is to be held at `now_ns`."""
        if not self.holds:
            return 0.0
        if self.paused or self.speed is None:
            return LOOKS_EVERY_S
        if self._anchor is None:
            self._anchor = self._now_s(), now_ns
        began_s, began_ns = self._anchor
        left_s = began_s + (now_ns - began_ns) * 1e-9 / self.speed - self._now_s()
        if left_s < -MOST_BEHIND_S:
            self._anchor = None
        return left_s

    def _attend_for(self, most_s: float) -> None:
        for key, _ in self._selector.select(most_s):
            key.data()

    def close(self) -> None:
        self._selector.close()
