"""The requests of a robot that wait for their answers: one at a time, or several if looks take a known time.

Without a known delay the next request gives the last one up: an answer to it that still comes is late. With one,
requests overlap, and a request is overdue after twice that delay; an answer gives up the requests before its own, as
what they measure is older.
"""

from __future__ import annotations

from agents.tracking.look_frames import UNASKED


class LooksUnderWay:
    def __init__(self, delay_ns: int = 0) -> None:
        self._delay_ns = delay_ns
        self._asked_ns: dict[int, int] = {}         # by number, in the order of asking
        self._overdue: set[int] = set()
        self.number = -1                            # of the last request
        self.last_ns: int | None = None             # its time

    def ask(self, now_ns: int) -> int:
        """Note a request, whose number is then `number`; return how many became overdue since the last one."""
        late = [number for number, asked_ns in self._asked_ns.items() if not self._delay_ns
                or (number not in self._overdue and now_ns - asked_ns >= 2 * self._delay_ns)]
        if self._delay_ns:
            self._overdue.update(late)
        else:
            self._asked_ns.clear()
        self.number += 1
        self._asked_ns[self.number] = self.last_ns = now_ns
        return len(late)

    @property
    def waiting(self) -> bool:
        return bool(self._asked_ns)

    def answered(self, number: int) -> int | None:
        """Return the time of the request that bears `number` in a frame, and forget it and those before; None: late."""
        for asked, asked_ns in self._asked_ns.items():
            if asked % UNASKED == number:
                self._asked_ns = {later: at_ns for later, at_ns in self._asked_ns.items() if later > asked}
                self._overdue.intersection_update(self._asked_ns)
                return asked_ns
        return None

    def forget(self, until_ns: int) -> None:
        """Forget the requests of until_ns and before; without a known delay all."""
        self._asked_ns = {number: asked_ns for number, asked_ns in self._asked_ns.items()
                          if self._delay_ns and asked_ns > until_ns}
        self._overdue.intersection_update(self._asked_ns)
