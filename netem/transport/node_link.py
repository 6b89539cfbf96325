"""The node's end of the wire: say hello, then answer one grant after the other until the last.

Bytes on the grant key that are no grant for the next window are counted and ignored; they never end a node.
"""

from __future__ import annotations

import gc
import os
import time
import traceback
from collections.abc import Callable
from typing import Final, TypeVar

import msgspec

from netem.node.node import Node
from netem.node.outside_guard import OutsideGuard
from netem.node.turn import Turn
from netem.transport.start_message import EmulatorPipe, StartMessage
from netem.transport.zenoh_session import ENTRANCES, Session
from netem.wire import keys
from netem.wire.errors import is_interruption
from netem.wire.instants import NEVER_NS
from netem.wire.messages import UNREADABLE, Grant, Hello, Report

Argument = TypeVar("Argument")
Result = TypeVar("Result")
COUNTERS_EVERY_S: Final = 0.5       # of wall clock: what a node has counted outlives it, and the emulator


def run_node(build: Callable[[StartMessage], Node]) -> int:
    """The whole life of a node's process: read the start message, build the node, answer grants until the last.

    Returns the process's exit code, 0 if the last grant ended it.
    """
    pipe = EmulatorPipe()
    start = pipe.read_start_message()
    code = _serve(start, build, pipe)
    pipe.await_end(start.timeout_s)
    return code


def _serve(start: StartMessage, build: Callable[[StartMessage], Node], pipe: EmulatorPipe) -> int:
    run, name = start.run, start.node
    encode = msgspec.msgpack.Encoder().encode
    decode = msgspec.msgpack.Decoder(Grant).decode
    with Session(start.secret, connect=start.endpoint) as session:
        grants = session.receiver(keys.grant(run, name))
        out = session.sender(keys.report(run, name))
        out.await_subscriber(start.timeout_s)
        fork = _Fork()
        guard = OutsideGuard(ENTRANCES, whole_process=True)
        turn: Turn = guard              # the same object, by its compiled class: read once for each grant
        if start.virtual_time:
            guard.begin()
        try:
            node = _in_this_process(fork, build, start)
            hello = node.hello()
            guard.check()
        except BaseException as error:
            if is_interruption(error):
                raise
            out.send(encode(Hello(name, 0, 0, [], [], error=guard.with_refusal(traceback.format_exc()))))
            return 1
        out.send(encode(hello))
        gc.collect()
        gc.freeze()
        gc.set_threshold(100_000, 50, 100)
        window = 0
        tell_s = time.monotonic() + COUNTERS_EVERY_S
        advance, monotonic = node.advance, time.monotonic
        while True:
            _, message = grants.receive()
            try:
                grant = decode(message)
                number = grant.window
                if number <= window:
                    raise msgspec.ValidationError(f"window {number} after {window}")
            except UNREADABLE:
                node.count("garbage grants")
                continue
            window = number
            try:
                report = _in_this_process(fork, advance, grant)
                if (now_s := monotonic()) > tell_s:
                    report.counters, tell_s = node.counters(), now_s + COUNTERS_EVERY_S
                message = encode(report)
                if turn.refusal is not None:
                    guard.check()
            except BaseException as error:
                if is_interruption(error):
                    raise
                out.send(encode(Report(window, node.now_ns, NEVER_NS, [], [], [], node.counters(),
                                       guard.with_refusal(traceback.format_exc()))))
                return 1
            out.send(message)
            if grant.last:
                pipe.has_said_all()         # closing the session takes a while, and the emulator does not wait for it
                return 0


class _Fork:
    """Whether this process is a child that the program has forked."""

    def __init__(self) -> None:
        self.is_child = False
        os.register_at_fork(after_in_child=self._note)

    def _note(self) -> None:
        self.is_child = True


def _in_this_process(fork: _Fork, call: Callable[[Argument], Result], argument: Argument) -> Result:
    """Return `call(argument)`; a child that the program forks in it ends here, whether the call returns or raises.

    The child shares the connection of the node, its parent. So it ends before it sends anything, and before the caller
    releases an object of Zenoh: compiled code does that as soon as an exception reaches it, and Zenoh would then tell
    the emulator that the node no longer listens.
    """
    try:
        return call(argument)
    finally:
        if fork.is_child:
            os._exit(0)
