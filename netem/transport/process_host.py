"""Runs each node in its own OS process, reached through Zenoh over the loopback.

Nodes are forked from one process (`fork_server`). A node gets its specification as one line on its standard input and
ends when that pipe closes, so no node outlives the emulator, however that ends. A watchdog thread wakes the waiting
conductor when a process has ended or the time-out has passed; the `NodeFailure` names the node and what its code did.

Invariants:
- time starts when every node has sent its hello and has subscribed to its grants;
- bytes on the report keys that are no report for the current window are counted (`garbage`) and ignored.
"""

from __future__ import annotations

import os
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import BinaryIO, Final, TypeVar
from uuid import uuid4

import msgspec

from netem.transport.diagnosis import words
from netem.transport.node_processes import NodeProcesses
from netem.transport.placement import Placement
from netem.transport.start_message import StartMessage
from netem.transport.zenoh_session import NotReachable, Receiver, Sender, Session, new_secret
from netem.wire import keys
from netem.wire.credible import credible
from netem.wire.errors import NodeFailure, programs_failed
from netem.wire.messages import UNREADABLE, Grant, Hello, Life, Report

WATCH_EVERY_S: Final = 0.05
GRACE_S: Final = 0.5                # for the last report of a process that has ended, which may still be on its way
# There are more nodes than cores, so thread pools for a robot's small matrices only slow the nodes down. Unbuffered
# output is in the log when a node fails. With a fixed hash seed a set has the same order in every run.
ENVIRONMENT: Final = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1",
                      "PYTHONHASHSEED": "0"}
LOG_TAIL_BYTES: Final = 4_000
FORK_SERVER_LOG: Final = "fork_server.log"      # no node has this name: names of nodes have no full stop
END_WITHIN_S: Final = 5.0
WAITING_AFTER_S: Final = 2.0
TELL_EVERY_S: Final = 0.5
KILL_AFTER_S: Final = 3.0
KILL_WITHIN_S: Final = 5.0          # for the end of a process that a fault kills
READY: Final = "word that it is ready"       # what the host waits for first
Message = TypeVar("Message", Hello, Report)


class ProcessHost:
    """`command` starts the fork server; `specifications` maps each node's name to the bytes in its start message.

    `priority` is that of the nodes' real-time scheduling, as in the start message.
    While nodes have not answered for `WAITING_AFTER_S`, `waiting` is called every `TELL_EVERY_S` with their names and
    the seconds waited.
    """

    def __init__(self, command: Sequence[str], specifications: Mapping[str, bytes], *, logs: Path,
                 timeout_s: float, real_time: bool = False, priority: int = 0,
                 waiting: Callable[[Sequence[str], float], None] = lambda nodes, waited_s: None) -> None:
        self._command = list(command)
        self._specifications = specifications
        self._logs = logs
        self._timeout_s = timeout_s
        self._waiting = waiting
        self._virtual_time = not real_time
        self._priority = priority
        self._run = uuid4().hex[:12]
        self._secret = new_secret()
        self._session: Session | None = None
        self._processes: NodeProcesses | None = None
        self._starting: dict[str, tuple[BinaryIO, threading.Thread]] = {}    # by node: (input, its writer)
        self._senders: dict[str, Sender] = {}
        self._encode = msgspec.msgpack.Encoder().encode
        self._decode_report = msgspec.msgpack.Decoder(Report).decode
        self._awaited: frozenset[str] | set[str] = frozenset()
        self._began_s = float("inf")            # start of the current wait for reports, inf if there is none
        self._deadline_s = float("inf")         # end of the wait in `last_words`, inf if there is none
        self._late: set[str] = set()            # nodes that the watchdog killed because sending to them blocks
        self._ended_s: dict[str, float] = {}
        self._over = threading.Event()
        self._watchdog: threading.Thread | None = None
        self._placement = Placement(lambda: (os.getpid(), *self._alive.pids().values()),
                                    cores=set() if real_time else None)
        self.garbage: Counter[str] = Counter()

    def start(self) -> dict[str, Hello]:
        self._logs.mkdir(parents=True, exist_ok=True)
        run = self._run
        self._session = Session(self._secret)
        self._reports: Receiver = self._session.receiver(
            keys.report(run), *(keys.report(run, name) for name in (*self._specifications, "-")))
        self._alarm = self._session.sender(keys.report(run, "-"))
        self._processes = NodeProcesses(self._command, self._logs / FORK_SERVER_LOG, os.environ | ENVIRONMENT)
        for name in self._specifications:
            self._spawn(name, None)
        self._watchdog = threading.Thread(target=self._watch, name="node watchdog", daemon=True)
        self._watchdog.start()
        self._expect(set(self._starting))
        hellos = self._collect(set(self._starting), msgspec.msgpack.Decoder(Hello).decode, READY)
        if failed := {name: ("could not start", hellos[name].error) for name in self._senders if hellos[name].error}:
            raise programs_failed(failed)
        for name in self._senders:
            self._greet(name, hellos[name])
        return hellos

    def kill(self, name: str) -> None:
        standard_input, teller = self._starting.pop(name)
        if not self._alive.end(name, KILL_WITHIN_S):
            raise NodeFailure(name, f"its process did not end within {KILL_WITHIN_S:g} s of SIGKILL",
                              detail=self._detail(name))
        teller.join()
        with suppress(OSError):
            standard_input.close()
        self._ended_s.pop(name, None)

    def revive(self, name: str, life: Life) -> Hello:
        self._spawn(name, life)
        awaited = {name}
        self._expect(awaited)
        hello = self._collect(awaited, msgspec.msgpack.Decoder(Hello).decode, READY)[name]
        if hello.error:
            raise programs_failed({name: ("could not start", hello.error)})
        self._greet(name, hello)
        return hello

    def _greet(self, name: str, hello: Hello) -> None:
        """Check the hello of a node, and wait until the node hears its grants."""
        credible(name, hello)
        try:
            self._senders[name].await_subscriber(self._timeout_s, give_up=partial(self._has_ended, name))
        except NotReachable as error:
            raise NodeFailure(name, f"does not hear its grants: {error}") from error

    def reachable_at(self) -> tuple[str, str]:
        """(Zenoh endpoint, name of the run) at which this host, once started, can be reached."""
        assert self._session is not None, "the host was not started"
        return self._session.endpoint, self._run

    def exchange(self, grants: Sequence[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        began_s = time.perf_counter()
        awaited = {name for name, _ in grants}
        self._expect(awaited)
        for name, grant in grants:
            self._senders[name].send(self._encode(grant))
        window = grants[0][1].window if grants else 0
        reports = self._collect(awaited, self._decode_report, f"answer in window {window}", window)
        if failed := {name: (f"its program failed at {reports[name].soft_ns} ns", reports[name].error)
                      for name, _ in grants if reports[name].error}:
            failure = programs_failed(failed)
            failure.counters = {name: reports[name].counters for name in failed}
            raise failure
        self._placement.exchanged(len(grants), time.perf_counter() - began_s)
        return [(name, reports[name]) for name, _ in grants]

    def last_words(self, grants: Sequence[tuple[str, Grant]], within_s: float) -> list[tuple[str, Report]]:
        """Reports that arrive within `within_s` from nodes whose processes run.

        A node that had not answered the previous grant for `WAITING_AFTER_S` is not waited for.
        """
        if self._session is None:
            return []
        owed_s, self._began_s = time.monotonic() - self._began_s, float("inf")
        hanging = self._awaited if owed_s > WAITING_AFTER_S else frozenset()
        window = grants[0][1].window if grants else 0
        awaited = {name for name, _ in grants if name in self._senders and not self._has_ended(name)}
        for name, grant in grants:
            if name in awaited:
                self._senders[name].send(self._encode(grant))
        reports = []
        self._awaited = awaited
        self._deadline_s = time.monotonic() + within_s
        while awaited - hanging and time.monotonic() < self._deadline_s:
            key, data = self._reports.receive()         # returns at the watchdog's next alarm at the latest
            name = keys.node_of(key)
            if name == "-":
                awaited -= {name for name in awaited if self._has_ended(name)}
                continue
            with suppress(*UNREADABLE):
                report = self._decode_report(data)
                if name in awaited and report.window == window and not report.error:
                    awaited.discard(name)
                    reports.append((name, report))
        self._deadline_s = float("inf")
        self._awaited = frozenset()
        return reports

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        """None: the processes tell theirs in reports."""
        return {}

    def stop(self) -> None:
        self._over.set()
        for name, (standard_input, teller) in self._starting.items():
            if teller.is_alive():               # the node did not read its start message: closing would wait for that
                self._alive.kill(name)
                continue
            with suppress(OSError):
                standard_input.close()          # the node's process ends when this pipe does
        if self._processes is not None:
            self._processes.close(END_WITHIN_S)
            self._placement.end()
        for standard_input, teller in self._starting.values():
            if teller.is_alive():
                teller.join()
            with suppress(OSError):
                standard_input.close()
        if self._session is not None:
            self._session.close()
            self._session = None
        if self._watchdog is not None:          # a thread within a call of Zenoh would abort the interpreter's exit
            self._watchdog.join(END_WITHIN_S)
            self._watchdog = None

    @property
    def _alive(self) -> NodeProcesses:
        assert self._processes is not None, "the host was not started"
        return self._processes

    def _spawn(self, name: str, life: Life | None) -> None:
        assert self._session is not None
        self._senders[name] = self._session.sender(keys.grant(self._run, name, 0 if life is None else life.number))
        start = StartMessage(self._session.endpoint, self._secret, self._run, name, self._timeout_s,
                             self._specifications[name], self._virtual_time, life,
                             self._priority)
        standard_input = self._alive.start(name, self._logs / f"{name}.log", again=life is not None)
        # A thread writes: if a process does not read, the start goes on and the watchdog can name that node.
        teller = threading.Thread(target=_tell, args=(standard_input, msgspec.json.encode(start) + b"\n"), daemon=True)
        self._starting[name] = standard_input, teller
        teller.start()

    def _expect(self, awaited: set[str]) -> None:
        """Start the wait for these nodes, whose length the watchdog measures from now on."""
        self._awaited = awaited
        self._began_s = time.monotonic()

    def _collect(self, awaited: set[str], decode: Callable[[bytes], Message], what: str,
                 window: int = 0) -> dict[str, Message]:
        """Return one message from each awaited node; raises NodeFailure if one has ended or is late.

        `what` names the message in the error. With a `window`, only reports of this window are collected.
        """
        collected: dict[str, Message] = {}
        self._awaited = awaited
        while awaited:
            key, data = self._reports.receive()
            name = keys.node_of(key)
            if name == "-":
                self._raise_for_missing(awaited, what)
                continue
            try:
                message = decode(data)
            except UNREADABLE:
                self.garbage[name] += 1
                continue
            if name not in awaited or (window and getattr(message, "window", 0) != window):
                self.garbage[name] += 1
                continue
            awaited.discard(name)
            collected[name] = message
        self._began_s = float("inf")
        return collected

    def _watch(self) -> None:
        """Wake the waiting conductor if a process has ended, if the wait is long, or if its deadline has passed."""
        told_s = 0.0
        while not self._over.wait(WATCH_EVERY_S):
            now_s = time.monotonic()
            if any(map(self._is_held, tuple(self._awaited))):
                self._began_s = now_s
            waited_s = now_s - self._began_s
            if waited_s > self._timeout_s + KILL_AFTER_S:       # the conductor is blocked while it sends to such a node
                for name in self._awaited - self._late:
                    self._late.add(name)
                    self._alive.dump_stacks(name)
                    self._alive.kill(name)
            tell = waited_s > WAITING_AFTER_S and now_s - told_s > TELL_EVERY_S
            late = now_s > self._deadline_s or waited_s > self._timeout_s
            if tell or late or any(map(self._has_ended, tuple(self._awaited))):
                told_s = now_s
                self._alarm.send(b"")

    def _raise_for_missing(self, awaited: set[str], what: str) -> None:
        now_s = time.monotonic()
        for name in sorted(awaited - self._late):
            if self._has_ended(name) and now_s > self._ended_s.setdefault(name, now_s) + GRACE_S:
                raise self._gone(name)
        waited_s = now_s - self._began_s
        if waited_s > self._timeout_s:
            raise self._hangs(min(awaited), awaited, what)
        if waited_s > WAITING_AFTER_S:
            self._waiting(sorted(awaited), waited_s)

    def _hangs(self, name: str, awaited: set[str], what: str) -> NodeFailure:
        stopped = self._alive.stopped(name)
        if name not in self._late:
            self._alive.dump_stacks(name)
        others = f"; also missing: {', '.join(sorted(awaited - {name}))}" if len(awaited) > 1 else ""
        garbage = f"; {self.garbage[name]} unreadable messages came from it" if self.garbage[name] else ""
        under_way = self._alive.under_way(name)
        self._alive.kill(name)
        why = words.hangs(f"no {what}", self._timeout_s, under_way, stopped=stopped, starting=what == READY)
        return NodeFailure(name, f"{why}{others}{garbage}", detail=self._detail(name))

    def _is_held(self, name: str) -> bool:
        """Return whether a debugger holds the node's code."""
        with suppress(OSError, KeyError):       # it was ended meanwhile
            return self._alive.under_way(name).held()
        return False

    def _has_ended(self, name: str) -> bool:
        return self._alive.exit_code(name) is not None

    def _gone(self, name: str) -> NodeFailure:
        code = self._alive.exit_code(name) or 0
        if self._alive.orphaned(name):
            return NodeFailure(name, f"the process that nodes are forked from {words.ended(code)}",
                               detail=self._tail(FORK_SERVER_LOG))
        return NodeFailure(name, f"its process {words.ended(code, self._alive.under_way(name))}",
                           detail=self._detail(name))

    def _detail(self, name: str) -> str:
        """Stack of the node's code, as it is or was when the process ended, and the tail of its log."""
        return "\n".join(filter(None, (words.stack(self._alive.under_way(name)).rstrip(), self._log_of(name))))

    def _log_of(self, name: str) -> str:
        return self._tail(f"{name}.log") or self._tail(FORK_SERVER_LOG)

    def _tail(self, log: str) -> str:
        return (self._logs / log).read_bytes()[-LOG_TAIL_BYTES:].decode(errors="replace")


def _tell(standard_input: BinaryIO, start: bytes) -> None:
    with suppress(OSError, ValueError):         # the node has ended, as the watchdog reports, or the host has stopped
        standard_input.write(start)
        standard_input.flush()
