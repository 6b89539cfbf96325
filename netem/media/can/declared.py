"""Compares the frames that nodes send with the messages that the scenario declares, for which alone the bounds hold.

    distance:  a frame of a message with period T and jitter J conforms if it is offered at or after  due - J;
               then  due <- max(due, now) + T (1 - CLOCK_TOLERANCE)

So the first and the last of n + 1 frames in a row lie at least n T (1 - CLOCK_TOLERANCE) - J apart. The tolerance
allows for the error of the sender's clock, which the bounds neglect.
Source: the virtual scheduling algorithm, ITU-T I.371 (2004), A.1.

Each difference of a message from its declaration is reported once, at most MOST_TOLD in all.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from netem.media.can.encoded_frame import EncodedFrame
from netem.media.can.messages import CanMessage

CLOCK_TOLERANCE: Final = 1e-3       # crystals of control units are within 1e-4; CAN itself allows up to 1.58e-2
MOST_TOLD: Final = 100
VOID: Final = "the bounds of the declared messages are void"


@dataclass
class _Watched:
    name: str
    message: CanMessage
    step_ns: int
    due_ns: int | None = None       # None before its first frame
    last_ns: int = 0


class DeclarationWatch:
    """Holds the declared messages of one bus and the instant at which the next frame of each is due."""

    def __init__(self, messages: Mapping[str, CanMessage]) -> None:
        self._by_rank = {message.rank: _Watched(name, message, round(message.period_ns * (1 - CLOCK_TOLERANCE)))
                         for name, message in messages.items()}
        self._told: set[tuple[int, str, str]] = set()

    def look(self, sender: str, encoded: EncodedFrame, now_ns: int) -> list[str]:
        """Return the differences, not reported before, of a frame that `sender` offers at `now_ns`."""
        found = []
        for what, words in self._differences(sender, encoded, now_ns):
            key = (encoded.rank, sender, what)
            if key not in self._told and len(self._told) < MOST_TOLD:
                self._told.add(key)
                found.append(words)
        return found

    def _differences(self, sender: str, encoded: EncodedFrame, now_ns: int) -> Iterator[tuple[str, str]]:
        """Yield (kind of difference, message)."""
        watched = self._by_rank.get(encoded.rank)
        if watched is None:
            yield "message", f"hands out a message that is not declared; {VOID}"
            return
        name, message = watched.name, watched.message
        if sender != message.sender:
            yield "sender", f"{name}: declared for {message.sender}; {VOID}"
        if encoded.fd != message.fd:
            yield "format", f"{name}: {_format(encoded.fd)}, declared as {_format(message.fd)}; {VOID}"
        elif encoded.fd and bool(encoded.data_bits) != message.bit_rate_switch:
            slower = f"; {VOID}" if message.bit_rate_switch else ""
            yield "switch", (f"{name}: {_switch(not message.bit_rate_switch)}, declared "
                             f"{_switch(message.bit_rate_switch)}{slower}")
        if encoded.data[4] != message.length_bytes:
            longer = f"; {VOID}" if encoded.data[4] > message.length_bytes else ""
            yield "length", f"{name}: {encoded.data[4]} bytes, declared with {message.length_bytes}{longer}"
        if watched.due_ns is not None and now_ns < watched.due_ns - message.jitter_ns:
            gap_ms = (now_ns - watched.last_ns) * 1e-6
            yield "period", (f"{name}: {gap_ms:.6g} ms after the one before, declared period "
                             f"{message.period_ns * 1e-6:.6g} ms, jitter {message.jitter_ns * 1e-6:.6g} ms; {VOID}")
        watched.due_ns = max(now_ns, watched.due_ns or now_ns) + watched.step_ns
        watched.last_ns = now_ns


def _format(fd: bool) -> str:
    return "CAN FD" if fd else "classical CAN"


def _switch(switched: bool) -> str:
    return f"{'with' if switched else 'without'} bit rate switch"
