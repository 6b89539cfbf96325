"""The node's end of the Zenoh connection: it sends a hello, then a report for each grant until the last.

Bytes on the grant key that are no grant for a later window are counted as "garbage grants" and ignored.
"""

from __future__ import annotations

import gc
import os
import time
import traceback
from collections.abc import Callable
from contextlib import ExitStack
from typing import Final, TypeVar

import msgspec

from netem.gateways.real_time_process import lock_memory, schedule_in_real_time
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
COUNTERS_EVERY_S: Final = 0.5       # wall clock; the emulator so knows the counters of a node that is killed


def run_node(build: Callable[[StartMessage], Node]) -> int:
    """Run a node's process: read the start message, build the node, answer grants until the last.

    Returns the process's exit code: 0 after the last grant, 1 if the program failed.
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
    with ExitStack() as ending, Session(start.secret, connect=start.endpoint) as session:
        grants = session.receiver(keys.grant(run, name, 0 if start.life is None else start.life.number))
        out = session.sender(keys.report(run, name))
        out.await_subscriber(start.timeout_s)
        fork = _Fork()
        guard = OutsideGuard(ENTRANCES, whole_process=True)
        turn: Turn = guard              # the same object by its compiled base class, whose fields are read faster
        if start.virtual_time:
            guard.begin()
        try:
            node = _in_this_process(fork, build, start)
            ending.callback(node.close)
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
        if start.priority:              # the emulator tells what is not allowed, as its process has the same rights
            schedule_in_real_time(start.priority)
            lock_memory()
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
                pipe.expect_end()           # the emulator does not wait until this session is closed
                return 0


class _Fork:
    """Tells whether this process is a child that the program has forked."""

    def __init__(self) -> None:
        self.is_child = False
        os.register_at_fork(after_in_child=self._note)

    def _note(self) -> None:
        self.is_child = True


def _in_this_process(fork: _Fork, call: Callable[[Argument], Result], argument: Argument) -> Result:
    """Return `call(argument)`. A child that the program forks during the call ends here, if the call returns or raises.

    The child shares the connection of the node, its parent. It must end before it sends a report, and before the caller
    releases an object of Zenoh, which compiled code does as soon as an exception reaches it: Zenoh would then tell the
    emulator that the node no longer subscribes to its grants.
    """
    try:
        return call(argument)
    finally:
        if fork.is_child:
            os._exit(0)
