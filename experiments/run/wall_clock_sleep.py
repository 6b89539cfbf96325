"""Refuses `time.sleep` in the program of a class, where it would delay the emulator while no robot time passes.

Blocking programs (`firmware_sim/blocking`), which sleep in virtual time, and threads other than the one that runs the
nodes may sleep. The caller is looked up on the stack only when a thread sleeps, so other code is not slowed down.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache

from netem.wire.program_errors import is_authors

OURS = ("netem", "fmus", "firmware_sim", "agents", "experiments")


class SleepRefused(RuntimeError):
    """The program of a class called `time.sleep`."""


@contextmanager
def sleep_refused() -> Iterator[None]:
    """Make `time.sleep` raise SleepRefused if a program of this thread calls it, also by `from time import sleep`."""
    real, thread = time.sleep, threading.get_ident()

    def sleep(seconds: float, /) -> None:
        if threading.get_ident() == thread and _program_calls():
            raise SleepRefused(f"time.sleep({seconds!r}) would hold up the emulator by the wall clock and let no robot "
                               "time pass; write `yield from self.board.sleep_until(self.board.now_ns + "
                               f"{_whole_ns(seconds)})`")
        real(seconds)

    changed = list(_replaced(real, sleep))
    try:
        yield
    finally:
        for module, name in changed:
            setattr(sys.modules[module], name, real)


def _replaced(real: Callable[[float], None], by: Callable[[float], None]) -> Iterator[tuple[str, str]]:
    """Replace the real function in `time` and in authors' modules; yield (module, name) of each replacement."""
    for module_name in ("time", *_authors_modules(len(sys.modules), next(reversed(sys.modules)))):
        module = sys.modules.get(module_name)
        for name, value in list(vars(module).items()) if module is not None else ():
            if value is real:
                setattr(module, name, by)
                yield module_name, name


@lru_cache(maxsize=1)
def _authors_modules(count: int, newest: str) -> tuple[str, ...]:
    """Return the names of authors' modules; a look at all modules takes 3 % of a run of 1 s, so it is kept.

    `count` of modules and the `newest` tell whether others have been imported since.
    """
    return tuple(name for name, module in list(sys.modules.items())
                 if name != "time" and isinstance(file := getattr(module, "__file__", None), str) and is_authors(file))


def _program_calls() -> bool:
    """Return whether the innermost frame of a program's author or of marconet is one of the author's."""
    frame = sys._getframe(2)
    while frame is not None:
        if str(frame.f_globals.get("__name__", "")).partition(".")[0] in OURS:
            return False
        if is_authors(frame.f_code.co_filename):
            return True
        frame = frame.f_back        # type: ignore[assignment]
    return False


def _whole_ns(seconds: float) -> str:
    return f"{round(seconds * 1e9):_}" if isinstance(seconds, int | float) else "..."
