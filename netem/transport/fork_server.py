"""The fork server: a process that has imported what nodes need and forks each node when the emulator asks for it.

    emulator --Start(node), with its input, log and memory--> fork server --fork--> node: `run_child(memory)`
             <------------- Started(node), Ended(node) ------      <--------ends-------

Forked nodes have the same memory layout and share the pages of imported modules. Nodes that take turns on a core then
use the same branch predictions and cache lines, and a node starts in milliseconds (docs/decisions/0009).

Invariants:
- the fork server has one thread and no Zenoh session, so a node inherits nothing but memory;
- it ends when the emulator has closed its end of the socket and the last node has ended. A node ends when its own pipe
  from the emulator closes; one whose program never releases the interpreter is killed after `END_WITHIN_S`;
- a process that a node has started ends with the node; a daemon, which has left the node's process group, ends with the
  last node.
"""

from __future__ import annotations

import gc
import os
import selectors
import signal
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Final

import msgspec

from netem.transport.diagnosis.stack_dump import ask_for_dump, dump_stacks_into
from netem.transport.diagnosis.under_way import UnderWay
from netem.transport.left_behind import end_children, take_orphans

LONGEST_MESSAGE: Final = 4096
END_WITHIN_S: Final = 5.0


class Start(msgspec.Struct, tag="start"):
    """Fork this node. The message carries three file descriptors: its standard input, log, and `UnderWay` memory."""

    node: str


class Kill(msgspec.Struct, tag="kill"):
    node: str


class Dump(msgspec.Struct, tag="dump"):
    """Let this node write the stacks of its threads into its `UnderWay` memory, even if it is stopped."""

    node: str


class Started(msgspec.Struct, tag="started"):
    node: str
    pid: int


class Ended(msgspec.Struct, tag="ended"):
    node: str
    exit_code: int              # -N: by signal N


def serve(run_child: Callable[[UnderWay], int]) -> int:
    """Fork nodes as the emulator asks over the socket that is the standard input.

    Returns the exit code; in the process of a node that is the result of `run_child`.
    """
    take_orphans()
    server = _ForkServer()
    gc.collect()
    gc.freeze()
    while server.has_work():
        happened = server.selector.select(server.patience_s)
        if not happened:
            server.kill_all()
        for key, _ in happened:
            if key.data:
                server.reap(key.data)
            elif (under_way := server.obey()) is not None:
                return run_child(under_way)      # this process is a node now
    return 0


class _ForkServer:
    def __init__(self) -> None:
        self.selector = selectors.DefaultSelector()
        self._emulator: socket.socket | None = socket.socket(fileno=os.dup(sys.stdin.fileno()))
        self._nodes: dict[str, tuple[int, int]] = {}            # (pid, pidfd)
        self._decode = msgspec.msgpack.Decoder(Start | Kill | Dump).decode
        self.selector.register(self._emulator, selectors.EVENT_READ, "")
        self.patience_s: float | None = None        # how long nodes may go on, None until the emulator has ended

    def has_work(self) -> bool:
        return self._emulator is not None or bool(self._nodes)

    def obey(self) -> UnderWay | None:
        """Do what the emulator's next message asks; returns the node's memory in the process of a new node only."""
        assert self._emulator is not None
        message, fds = b"", list[int]()
        with suppress(ConnectionResetError):        # the emulator ended with messages unread
            message, fds, _, _ = socket.recv_fds(self._emulator, LONGEST_MESSAGE, 3)
        if not message:
            self.selector.unregister(self._emulator)
            self._emulator.close()
            self._emulator = None
            self.patience_s = END_WITHIN_S
            return None
        order = self._decode(message)
        if isinstance(order, Kill):
            if order.node in self._nodes:
                _kill_group(self._nodes[order.node][0])
            return None
        if isinstance(order, Dump):
            if order.node in self._nodes:
                ask_for_dump(self._nodes[order.node][0])
            return None
        pid = os.fork()
        if pid == 0:
            return self._become(order.node, *fds)
        for fd in fds:
            os.close(fd)
        pidfd = os.pidfd_open(pid)
        self._nodes[order.node] = pid, pidfd
        self.selector.register(pidfd, selectors.EVENT_READ, order.node)
        self._tell(Started(order.node, pid))
        return None

    def reap(self, node: str) -> None:
        """Report the end of `node`, after killing the processes that it started."""
        pid, pidfd = self._nodes.pop(node)
        self.selector.unregister(pidfd)
        os.close(pidfd)
        _kill_group(pid)            # before waitpid, after which another process may get the same id
        _, status = os.waitpid(pid, 0)
        if not self._nodes:
            end_children()
        self._tell(Ended(node, os.waitstatus_to_exitcode(status)))

    def kill_all(self) -> None:
        for pid, _ in self._nodes.values():
            _kill_group(pid)

    def _become(self, node: str, standard_input: int, log: int, memory: int) -> UnderWay:
        """Turn this process into `node`: its own standard files, a name for `ps`, and a process group.

        The group keeps Ctrl-C from the node: it reaches the emulator only.
        """
        os.setpgid(0, 0)
        for target, fd in ((0, standard_input), (1, log), (2, log)):
            os.dup2(fd, target)
        self.selector.close()
        assert self._emulator is not None
        self._emulator.close()
        for fd in (standard_input, log, *(pidfd for _, pidfd in self._nodes.values())):
            os.close(fd)
        with suppress(OSError), open("/proc/self/comm", "w") as title:
            title.write(node[:15])
        under_way = UnderWay(memory)
        dump_stacks_into(under_way)
        return under_way

    def _tell(self, news: Started | Ended) -> None:
        if self._emulator is not None:
            with suppress(OSError):             # the emulator has ended, which `obey` will notice
                self._emulator.send(msgspec.msgpack.encode(news))


def _kill_group(node: int) -> None:
    """Kill the node and the processes that it started, or the node alone if it is in no group of its own."""
    for kill in (os.killpg, os.kill):
        with suppress(ProcessLookupError):
            kill(node, signal.SIGKILL)
