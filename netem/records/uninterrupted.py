"""Holds SIGINT, SIGTERM and SIGHUP back while a `with` block runs, so that none of them ends the block halfway.

    with uninterrupted():
        rows go to the file, the hash and the counters, or to none of them

The handlers run after the block, in the order in which the signals arrived. Outside the main thread the block runs
unchanged, as Python calls no handlers there.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

ENDING: Final = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def uninterrupted(*, drop: bool = False) -> Iterator[list[int]]:
    """Hold back, or with `drop` ignore, the signals in `ENDING`; yields the list of those that arrive meanwhile."""
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return

    def note(number: int, frame: FrameType | None) -> None:
        came.append(number)

    before = {number: signal.getsignal(number) for number in ENDING}
    held = [number for number in ENDING if before[number] not in (signal.SIG_IGN, None)]
    for number in held:
        signal.signal(number, note)
    try:
        yield came
    finally:
        for number in held:
            signal.signal(number, before[number])
    if not drop:
        for number in dict.fromkeys(came):
            signal.raise_signal(number)
