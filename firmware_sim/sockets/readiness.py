"""Waits in virtual time until one of several descriptors is ready: `select.select`, `select.poll`, selectors, asyncio.

A virtual socket can always be written to. If none of the descriptors is virtual, the real `select` is called, which
holds the run up; real and virtual ones together are refused. Without any the call is a sleep.
"""

from __future__ import annotations

import select
import selectors
from collections.abc import Iterable, Mapping
from typing import Any, Final

from firmware_sim.blocking.here import this_program
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.seconds import duration_ns
from firmware_sim.sockets.virtual_files import FILES, VirtualSocket, refuse
from netem.wire.instants import NEVER_NS

READ, WRITE = selectors.EVENT_READ, selectors.EVENT_WRITE
MIXED: Final = "wait for it in a thread of its own, or for sockets only"
_select_really = select.select
_poll_really = select.poll


def ready(program: BlockingProgram, wanted: Mapping[int, int], timeout: float | None) -> dict[int, int]:
    """Return the events (READ, WRITE) of the descriptors that are ready within `timeout` seconds; None: wait for ever.

    `wanted` maps descriptors to the events that are waited for.
    """
    files = {fd: FILES.get(fd) for fd in wanted}
    virtual = {fd: file for fd, file in files.items() if file is not None}
    if len(virtual) < len(files):
        strange = next(fd for fd, file in files.items() if file is None)
        if virtual:
            refuse(f"waiting for the descriptor {strange} together with sockets", MIXED)
        return _really_ready(wanted, timeout)
    wait_ns = None if timeout is None else duration_ns(max(0.0, timeout))
    found = _events(virtual, wanted)
    if not found and wait_ns == 0:
        program.note_call()
        return _events(virtual, wanted)
    if found or wait_ns == 0:
        return found
    watched = [file for fd, file in virtual.items() if wanted[fd] & READ]
    hears = any(file.hears for file in watched)
    until_ns = NEVER_NS if wait_ns is None else program.due_ns(wait_ns)
    thread = program.thread()
    for file in watched:
        file.watchers.append(thread)
    try:
        while not (found := _events(virtual, wanted)) and program.wait(until_ns, hears=hears):
            pass
        return found or _events(virtual, wanted)
    finally:
        for file in watched:
            file.watchers.remove(thread)


def _events(files: Mapping[int, VirtualSocket], wanted: Mapping[int, int]) -> dict[int, int]:
    found = {fd: (READ if wanted[fd] & READ and file.readable() else 0) | (wanted[fd] & WRITE)
             for fd, file in files.items()}
    return {fd: events for fd, events in found.items() if events}


def _really_ready(wanted: Mapping[int, int], timeout: float | None) -> dict[int, int]:
    poll = _poll_really()
    for fd, events in wanted.items():
        poll.register(fd, (select.POLLIN if events & READ else 0) | (select.POLLOUT if events & WRITE else 0))
    return {fd: (READ if events & ~select.POLLOUT else 0) | (WRITE if events & ~select.POLLIN else 0)
            for fd, events in poll.poll(None if timeout is None else max(0.0, timeout) * 1000)}


def descriptor(file: Any) -> int:
    """Return the descriptor of what `select` takes: a number, or an object with `fileno`."""
    fd = file if isinstance(file, int) else file.fileno()
    if not isinstance(fd, int):
        raise TypeError("argument must be an int, or have a fileno() method.")
    if fd < 0:
        raise ValueError(f"file descriptor cannot be a negative integer ({fd})")
    return fd


def select_virtually(program: BlockingProgram, readers: Iterable[Any], writers: Iterable[Any], others: Iterable[Any],
                     timeout: float | None = None) -> tuple[list[Any], list[Any], list[Any]]:
    """Do what `select.select` does."""
    if timeout is not None and timeout < 0:
        raise ValueError("timeout must be non-negative")
    reading = [(file, descriptor(file)) for file in readers]
    writing = [(file, descriptor(file)) for file in writers]
    for other in others:
        descriptor(other)
    if not any(fd in FILES for _, fd in (*reading, *writing)) and (reading or writing):
        return _select_really([file for file, _ in reading], [file for file, _ in writing], [], timeout)
    wanted: dict[int, int] = {}
    for pairs, event in ((reading, READ), (writing, WRITE)):
        for _, fd in pairs:
            wanted[fd] = wanted.get(fd, 0) | event
    found = ready(program, wanted, timeout)
    return ([file for file, fd in reading if found.get(fd, 0) & READ],
            [file for file, fd in writing if found.get(fd, 0) & WRITE], [])


class VirtualPoll:
    """What `select.poll()` returns to a blocking program."""

    def __init__(self) -> None:
        self._wanted: dict[int, int] = {}

    def register(self, file: Any, eventmask: int = select.POLLIN | select.POLLPRI | select.POLLOUT) -> None:
        self._wanted[descriptor(file)] = eventmask

    def modify(self, file: Any, eventmask: int) -> None:
        fd = descriptor(file)
        if fd not in self._wanted:
            raise FileNotFoundError(2, "No such file or directory")
        self._wanted[fd] = eventmask

    def unregister(self, file: Any) -> None:
        del self._wanted[descriptor(file)]

    def poll(self, timeout: float | None = None) -> list[tuple[int, int]]:
        """`timeout` is in milliseconds; None, or a negative one, waits for ever."""
        wanted = {fd: (READ if mask & select.POLLIN else 0) | (WRITE if mask & select.POLLOUT else 0)
                  for fd, mask in self._wanted.items()}
        found = ready(this_program(), wanted, None if timeout is None or timeout < 0 else timeout / 1000)
        return [(fd, (select.POLLIN if events & READ else 0) | (select.POLLOUT if events & WRITE else 0))
                for fd, events in found.items()]


class VirtualSelector(selectors._BaseSelectorImpl):
    """What `selectors.DefaultSelector()` returns to a blocking program, its event loops included."""

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        keys = self.get_map()
        by_fd = {key.fd: key for key in keys.values()}
        found = ready(this_program(), {fd: key.events for fd, key in by_fd.items()}, timeout)
        return [(by_fd[fd], events) for fd, events in found.items()]
