"""The library's handlers in virtual time: FIFO and ring channels, callbacks, and what a caller may give as one.

    message --put--> channel --recv--> program           message --put--> queue --thread of its own--> callback

As in the library, a full FIFO makes the one who puts wait, and with it all that the session receives; a ring drops its
oldest item; a callback runs in a thread of its own unless it is made with `indirect=False`; an exception in it is
printed, and the next item is handled.
"""

from __future__ import annotations

import sys
import threading
import traceback
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from firmware_sim.blocking.here import running
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.program_thread import ProgramThread
from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.real import HANDLERS, ZError

ROOM = 256                      # items of the library's default channel
CLOSED = "channel is empty and closed"


class Sink(Protocol):
    """Where an entity puts what it receives; all in threads of the program."""

    def put(self, item: Any) -> None: ...

    def close(self) -> None: ...


class Queue:
    """Items between threads of a program, at most `room`."""

    def __init__(self, program: BlockingProgram, room: int, *, drops_oldest: bool = False) -> None:
        self.closed = False
        self._program = program
        self._room = room
        self._drops_oldest = drops_oldest
        self._items: deque[Any] = deque()
        self._takers: deque[ProgramThread] = deque()
        self._givers: deque[ProgramThread] = deque()

    def put(self, item: Any) -> None:
        """Add an item; wait while the queue is full, unless it drops its oldest. A closed queue drops the item."""
        if self._drops_oldest and len(self._items) >= self._room:
            self._items.popleft()
        while len(self._items) >= self._room and not self.closed:
            self._wait(self._givers)
        if not self.closed:
            self._items.append(item)
            self._wake(self._takers)

    def take(self) -> Any:
        """Return the oldest item; wait for one; ZError if the queue is closed and empty."""
        while not self._items:
            if self.closed:
                raise ZError(CLOSED)
            self._wait(self._takers)
        self._program.thread().row.end()
        return self._pop()

    def try_take(self) -> Any:
        """Return the oldest item, None if there is none; ZError if the queue is closed and empty."""
        if self._items:
            return self._pop()
        if self.closed:
            raise ZError(CLOSED)
        self._program.note_call()
        return None

    def close(self) -> None:
        self.closed = True
        for thread in (*self._takers, *self._givers):
            self._program.wake(thread)

    def _pop(self) -> Any:
        item = self._items.popleft()
        self._wake(self._givers)
        if self._items:
            self._wake(self._takers)
        return item

    def _wait(self, waiting: deque[ProgramThread]) -> None:
        thread = self._program.thread()
        waiting.append(thread)
        try:
            self._program.wait(hears=True)
        finally:
            waiting.remove(thread)

    def _wake(self, waiting: deque[ProgramThread]) -> None:
        if waiting:
            self._program.wake(waiting[0])


class Handler(StandIn):
    """The receiving end of a channel."""

    real = HANDLERS.Handler

    def __init__(self, queue: Queue, of: str) -> None:
        self._queue = queue
        self._of = of

    def try_recv(self) -> Any:
        return self._queue.try_take()

    def recv(self) -> Any:
        return self._queue.take()

    def __iter__(self) -> Handler:
        return self

    def __next__(self) -> Any:
        try:
            return self._queue.take()
        except ZError:
            raise StopIteration from None

    def __repr__(self) -> str:
        return f"Handler[{self._of}]"


class DefaultHandler(StandIn):
    real = HANDLERS.DefaultHandler
    room = ROOM
    drops_oldest = False

    def __new__(cls, *args: Any) -> Any:
        return cls.real(*args) if running() is None else object.__new__(cls)


class FifoChannel(DefaultHandler):
    real = HANDLERS.FifoChannel

    def __init__(self, capacity: int) -> None:
        self.room = max(1, capacity)


class RingChannel(FifoChannel):
    real = HANDLERS.RingChannel
    drops_oldest = True


class Callback(StandIn):
    real = HANDLERS.Callback

    def __new__(cls, *args: Any, **kwargs: Any) -> Any:
        return cls.real(*args, **kwargs) if running() is None else object.__new__(cls)

    def __init__(self, callback: Callable[[Any], Any], drop: Callable[[], Any] | None = None, *,
                 indirect: bool = True) -> None:
        self.callback, self.drop, self.indirect = callback, drop, indirect

    def __call__(self, arg: Any, /) -> Any:
        return self.callback(arg)


class Direct:
    """Calls the callback in the thread that puts."""

    def __init__(self, callback: Callable[[Any], Any], drop: Callable[[], Any] | None) -> None:
        self._callback, self._drop = callback, drop

    def put(self, item: Any) -> None:
        _guarded(self._callback, item)

    def close(self) -> None:
        if self._drop is not None:
            _guarded(self._drop)


class Indirect:
    """Calls the callback in a thread of its own."""

    def __init__(self, program: BlockingProgram, callback: Callable[[Any], Any],
                 drop: Callable[[], Any] | None) -> None:
        self._queue = Queue(program, ROOM)
        self._callback, self._drop = callback, drop
        threading.Thread(target=self._run, name="zenoh callback", daemon=True).start()

    def put(self, item: Any) -> None:
        self._queue.put(item)

    def close(self) -> None:
        self._queue.close()

    def _run(self) -> None:
        while True:
            try:
                item = self._queue.take()
            except ZError:
                break
            _guarded(self._callback, item)
            del item                # a query that the callback has not kept ends here
        if self._drop is not None:
            _guarded(self._drop)


def _guarded(function: Callable[..., Any], *args: Any) -> None:
    try:
        function(*args)
    except Exception:
        print(f"callback error\n{traceback.format_exc()}", end="", file=sys.stderr, flush=True)


def open_sink(program: BlockingProgram, given: Any, of: str) -> tuple[Sink, Any, bool]:
    """Return where to put the items, the `handler` attribute, and whether a callback goes on without its owner.

    `given` is None, a channel, a callable, or (callable, handler); ValueError for anything else.
    """
    if given is None:
        given = DefaultHandler()
    if isinstance(given, DefaultHandler):
        queue = Queue(program, given.room, drops_oldest=given.drops_oldest)
        return queue, Handler(queue, of), False
    handler = None
    if isinstance(given, tuple) and len(given) == 2:
        given, handler = given
    if isinstance(given, Callback) and not given.indirect:
        return Direct(given.callback, given.drop), handler, True
    if callable(given):
        return Indirect(program, given, given.drop if isinstance(given, Callback) else None), handler, True
    raise ValueError(f"Invalid handler type {type(given).__name__}")
