"""The emulator's end of the fork server: starts nodes, learns which have ended and how, kills those that remain.

Invariants:
- no thread of its own: each method reads the fork server's messages first, under one lock;
- when the fork server itself has ended, every node whose end it had not reported counts as ended with its exit code.
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
_log: Final = logging.getLogger(__name__)


class NodeProcesses:
    """`command` starts the fork server, whose own output goes to `log`."""

    def __init__(self, command: Sequence[str], log: Path, environment: Mapping[str, str]) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        # A process group of its own, so that Ctrl-C reaches the emulator only, which ends its nodes. No session of its
        # own: Linux would schedule it as a separate group (autogroup), and a grant would take twice as long.
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

    def start(self, node: str, log: Path, again: bool = False) -> BinaryIO:
        """Start `node` with its output going to `log`, added to what is there if `again`; returns its standard input.

        The node ends when that closes.
        """
        reading, writing = os.pipe()
        self._names.add(node)
        under_way = self._under_way[node] = UnderWay()
        self._listen()          # the fork server does not read while its own messages fill the socket
        try:
            with log.open("ab" if again else "wb") as file:
                self._tell(Start(node), [reading, file.fileno(), under_way.file])
        finally:
            os.close(reading)
        return open(writing, "wb")

    def pids(self) -> dict[str, int]:
        """Process ids of the nodes that have been forked so far."""
        self._listen()
        return dict(self._pids)

    def exit_code(self, node: str) -> int | None:
        """Exit code of `node`, -N for signal N; None while it runs."""
        self._listen()
        return self._exit_codes.get(node)

    def orphaned(self, node: str) -> bool:
        """Whether `node` counts as ended because the fork server has ended; `exit_code` is then the fork server's."""
        return node in self._orphans

    def under_way(self, node: str) -> UnderWay:
        """The record of the code that `node` runs, or ran when its process ended."""
        return self._under_way[node]

    def dump_stacks(self, node: str) -> None:
        """Let `node` write its stacks into its `UnderWay` memory; returns when it has, or after two seconds."""
        await_dump(self._under_way[node], lambda: self._tell(Dump(node), []))

    def stopped(self, node: str) -> bool:
        """Whether the process of `node` is stopped, as by SIGSTOP."""
        with suppress(OSError, KeyError, IndexError):
            stat = Path(f"/proc/{self._pids[node]}/stat").read_text(errors="replace")
            return stat.rpartition(")")[2].split()[0] == "T"
        return False

    def kill(self, node: str) -> None:
        self._tell(Kill(node), [])

    def end(self, node: str, timeout_s: float) -> bool:
        """Kill `node` and wait for its end, so that it can be started again; False if it lives after `timeout_s`."""
        self.kill(node)
        deadline_s = time.monotonic() + timeout_s
        while self.exit_code(node) is None and (left_s := deadline_s - time.monotonic()) > 0:
            self._listen(left_s)
        if self.exit_code(node) is None or node in self._orphans:
            return False
        self._under_way.pop(node).close()
        for known in (self._exit_codes, self._pids):
            del known[node]
        self._names.discard(node)
        return True

    def close(self, timeout_s: float) -> None:
        """Wait up to `timeout_s` for the nodes to end, then kill the others, and end the fork server."""
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
        """Send an order. If the fork server has ended, nothing is raised: `exit_code` reports it."""
        with self._lock, suppress(OSError):
            self._socket.settimeout(TELL_WITHIN_S)
            socket.send_fds(self._socket, [msgspec.msgpack.encode(order)], fds)

    def _running(self) -> set[str]:
        self._listen()
        return self._names - self._exit_codes.keys()

    def _await_ends(self, timeout_s: float) -> None:
        """Wait up to `timeout_s` for the forked nodes to end, and up to `NOT_FORKED_S` for nodes to be forked."""
        began_s = time.monotonic()
        while running := self._running():
            patience_s = timeout_s if running <= self._pids.keys() else min(timeout_s, NOT_FORKED_S)
            if (left_s := began_s + patience_s - time.monotonic()) <= 0:
                return
            self._listen(left_s)

    def _listen(self, wait_s: float = 0.0) -> None:
        """Read the fork server's messages, waiting up to `wait_s` for the first one."""
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
