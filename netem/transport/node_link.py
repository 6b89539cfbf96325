"""The node's end of the wire: say hello, then answer one grant after the other until the last.

Bytes on the grant key that are no grant for the next window are counted and ignored; they never end a node.
"""

from __future__ import annotations

import gc
import traceback
from collections.abc import Callable

import msgspec

from netem.agenda import NEVER_NS
from netem.lockstep.messages import Grant, Hello, Report
from netem.node import Node
from netem.transport import keys
from netem.transport.zenoh_session import Session


def serve(endpoint: str, run: str, name: str, build: Callable[[], Node], timeout_s: float) -> int:
    """Build the node, take part in the run, return the process's exit code (0: ended by the last grant)."""
    encode = msgspec.msgpack.Encoder().encode
    decode = msgspec.msgpack.Decoder(Grant).decode
    with Session(run, connect=endpoint) as session:
        grants = session.receiver(keys.grant(run, name))
        out = session.sender(keys.report(run, name))
        out.await_subscriber(timeout_s)
        try:
            node = build()
            hello = node.hello()
        except Exception:
            out.send(encode(Hello(name, 0, 0, [], [], traceback.format_exc())))
            return 1
        out.send(encode(hello))
        gc.collect()
        gc.freeze()
        window = 0
        while True:
            _, message = grants.receive()
            try:
                grant = decode(message)
                if grant.window <= window:
                    raise msgspec.ValidationError(f"window {grant.window} after {window}")
            except msgspec.MsgspecError:
                node.count("garbage grants")
                continue
            window = grant.window
            try:
                report = node.advance(grant)
            except Exception:
                out.send(encode(Report(window, NEVER_NS, NEVER_NS, [], [], [], {}, traceback.format_exc())))
                return 1
            out.send(encode(report))
            if grant.last:
                return 0
