"""The queue of STATUSTEXT, texts for the operator of at most 50 characters, each at most once a second."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from firmware_sim.autopilot.vehicle import Severity
from firmware_sim.mavlink.dialect import Message, message

MOST_WAITING: Final = 20
LONGEST: Final = 50
AGAIN_NS: Final = 1_000_000_000


@dataclass
class StatusTexts:
    _waiting: deque[tuple[Severity, str]] = field(default_factory=deque, init=False)
    _said_ns: dict[str, int] = field(default_factory=dict, init=False)

    def say(self, severity: Severity, text: str, now_ns: int) -> bool:
        """Queue a text; False if it was queued less than a second ago, or if the queue is full."""
        said_ns = self._said_ns.get(text)
        if said_ns is not None and 0 <= now_ns - said_ns < AGAIN_NS:
            return False
        if len(self._waiting) >= MOST_WAITING:
            return False
        self._said_ns = {known: at_ns for known, at_ns in self._said_ns.items() if 0 <= now_ns - at_ns < AGAIN_NS}
        self._said_ns[text] = now_ns
        self._waiting.append((severity, text))
        return True

    def next(self) -> Message | None:
        if not self._waiting:
            return None
        severity, text = self._waiting.popleft()
        return message("STATUSTEXT", severity=severity, text=text.encode("ascii", "replace")[:LONGEST])
