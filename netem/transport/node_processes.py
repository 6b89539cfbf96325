"""The emulator's end of the fork server: start nodes, learn which have ended and how, end what is left.

Invariants:
- what the fork server says is read by whoever asks, under one lock; no thread of its own;
- when the fork server itself has ended, every node that it had not buried counts as ended with its exit code.
"""

from __future__ import annotations

import logging
import os
import socket
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Final

import msgspec

from netem.transport.diagnosis import words
from netem.transport.diagnosis.stack_dump import await_dump
from netem.transport.diagnosis.under_way import UnderWay
from netem.transport.fork_server import LONGEST_MESSAGE, Dump, Ended, Kill, Start, Started

NOT_FORKED_S: Final = 1.0
TELL_WITHIN_S: Final = 5.0
_log: Final = logging.getLogger(__name__)       # a warning goes to the standard error, unless told otherwise


class NodeProcesses:
    """`command` starts the fork server; what it prints itself goes to `log`."""

    def __init__(self, command: Sequence[str], log: Path, environment: Mapping[str, str]) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        # Its own process group: Ctrl-C reaches the emulator only, which ends its nodes. Not its own session: Linux
        # would schedule it in a group of its own (autogroup), and a grant would take twice as long.
        with theirs, log.open("wb") as file:
            self._server = subprocess.Popen(command, stdin=theirs.fileno(), stdout=file, stderr=subprocess.STDOUT,
                                            process_group=0, env=environment)
        self._decode = msgspec.msgpack.Decoder(Started | Ended).decode
        self._lock = threading.Lock()
        self._names: set[str] = set()
        self._exit_codes: dict[str, int] = {}
        self._orphans: set[str] = set()
        self._pids: dict[str, int] = {}
        self._under_way: dict[str, UnderWay] = {}

    def start(self, node: str, log: Path) -> BinaryIO:
        """Start `node`, its output going to `log`; returns its standard input, which it ends with."""
        reading, writing = os.pipe()
        self._names.add(node)
        under_way = self._under_way[node] = UnderWay()
        self._listen()          # so that neither end waits for the other to read
        try:
            with log.open("wb") as file:
                self._tell(Start(node), [reading, file.fileno(), under_way.file])
        finally:
            os.close(reading)
        return open(writing, "wb")

    def pids(self) -> dict[str, int]:
        """Process ids of the nodes that were forked so far."""
        self._listen()
        return dict(self._pids)

    def exit_code(self, node: str) -> int | None:
        """How `node` ended, -N for signal N; None while it runs."""
        self._listen()
        return self._exit_codes.get(node)

    def orphaned(self, node: str) -> bool:
        """Whether `node` counts as ended because the fork server has: `exit_code` is that of the fork server."""
        return node in self._orphans

    def under_way(self, node: str) -> UnderWay:
        """The Python stack of `node` and its FMI call, now or when its process ended."""
        return self._under_way[node]

    def dump_stacks(self, node: str) -> None:
        """Let `node` write its stacks into its memory; returns when it has, or after two seconds."""
        await_dump(self._under_way[node], lambda: self._tell(Dump(node), []))

    def stopped(self, node: str) -> bool:
        """Whether the process of `node` is stopped, as by SIGSTOP."""
        with suppress(OSError, KeyError, IndexError):
            stat = Path(f"/proc/{self._pids[node]}/stat").read_text(errors="replace")
            return stat.rpartition(")")[2].split()[0] == "T"
        return False

    def kill(self, node: str) -> None:
        self._tell(Kill(node), [])

    def close(self, timeout_s: float) -> None:
        """Wait for nodes that are ending; kill what has not ended in time, the fork server at last."""
        self._await_ends(timeout_s)
        for node in sorted(self._running()):
            self.dump_stacks(node)
            where = words.location(self._under_way[node])
            _log.warning("node %s: its process did not end within %g s, and was killed%s", node, timeout_s,
                         where and f": it hangs{where}")
            self.kill(node)
        self._await_ends(timeout_s)
        for under_way in self._under_way.values():
            under_way.close()
        self._socket.close()
        try:
            self._server.wait(0.0 if self._running() else timeout_s)
        except subprocess.TimeoutExpired:
            self._server.kill()
            self._server.wait()

    def _tell(self, order: Start | Kill | Dump, fds: list[int]) -> None:
        """A fork server that is gone is no error here: `exit_code` says so."""
        with self._lock, suppress(OSError):
            self._socket.settimeout(TELL_WITHIN_S)
            socket.send_fds(self._socket, [msgspec.msgpack.encode(order)], fds)

    def _running(self) -> set[str]:
        self._listen()
        return self._names - self._exit_codes.keys()

    def _await_ends(self, timeout_s: float) -> None:
        """Wait for every node that was forked, and a moment for the fork server to fork those that were not."""
        began_s = time.monotonic()
        while running := self._running():
            patience_s = timeout_s if running <= self._pids.keys() else min(timeout_s, NOT_FORKED_S)
            if (left_s := began_s + patience_s - time.monotonic()) <= 0:
                return
            self._listen(left_s)

    def _listen(self, wait_s: float = 0.0) -> None:
        """Take in what the fork server has said, waiting at most `wait_s` for the first word."""
        with self._lock:
            while True:
                try:
                    self._socket.settimeout(wait_s)
                    message = self._socket.recv(LONGEST_MESSAGE)
                except (BlockingIOError, TimeoutError):
                    return
                except OSError:
                    message = b""
                if not message:
                    if (code := self._server.poll()) is not None:
                        orphans = self._names - self._exit_codes.keys()
                        self._orphans |= orphans
                        self._exit_codes |= dict.fromkeys(orphans, code)
                    return
                wait_s = 0.0
                news = self._decode(message)
                if isinstance(news, Started):
                    self._pids[news.node] = news.pid
                else:
                    self._exit_codes[news.node] = news.exit_code
