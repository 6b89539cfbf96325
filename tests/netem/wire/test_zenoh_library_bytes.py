"""Zenoh's own bytes between two real sessions, beside ours: the same, up to the numbers that Zenoh gives to keys."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress

import pytest
import zenoh

from netem.wire.zenoh_codec import decode, encode
from netem.wire.zenoh_frames import ZenohSender
from netem.wire.zenoh_messages import (
    ENCODINGS,
    Data,
    Declare,
    Entity,
    Push,
    Qos,
    Request,
    Response,
    ResponseFinal,
    Stamp,
)
from tests.free_port import free_port

WITHIN_S = 20.0
FRAME, FRAGMENT = 0x05, 0x06


class Wire:
    """Two sessions with a relay between them that keeps every batch."""

    def __init__(self) -> None:
        self.batches: list[bytes] = []
        self._ends: tuple[socket.socket, ...] = ()
        port = free_port()
        self.listener = zenoh.open(_config([f"tcp/127.0.0.1:{port}"], []))
        self._relay = socket.create_server(("127.0.0.1", 0))
        threading.Thread(target=self._accept, args=(port,), daemon=True).start()
        self.caller = zenoh.open(_config([], [f"tcp/127.0.0.1:{self._relay.getsockname()[1]}"]))

    def close(self) -> None:
        self.caller.close()
        self.listener.close()
        for each in (self._relay, *self._ends):
            each.close()

    def _accept(self, port: int) -> None:
        near, _ = self._relay.accept()
        far = socket.create_connection(("127.0.0.1", port))
        self._ends = near, far
        for source, sink in ((near, far), (far, near)):
            threading.Thread(target=self._pump, args=(source, sink), daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):         # the other side has closed
            self._copy(source, sink)

    def _copy(self, source: socket.socket, sink: socket.socket) -> None:
        waiting = b""
        while data := source.recv(65536):
            waiting += data
            while len(waiting) >= 2 and len(waiting) >= 2 + (size := int.from_bytes(waiting[:2], "little")):
                if size:                # under load the library has sent a batch without a byte
                    self.batches.append(waiting[2:2 + size])
                waiting = waiting[2 + size:]
            sink.sendall(data)              # only now, so that no answer is kept before what it answers
        sink.shutdown(socket.SHUT_WR)

    def of(self, act: Callable[[], object], marker: bytes, batches: int = 1) -> bytes:
        """Return the network messages of the batch that `act` causes and that contains `marker`, and of those that
        follow, `batches` in all or fewer if there come no more.
        """
        self.batches.clear()
        act()
        end = time.monotonic() + WITHIN_S
        while time.monotonic() < end:
            frames = [batch for batch in list(self.batches) if batch[0] & 0x1F == FRAME]
            found = [index for index, batch in enumerate(frames) if marker in batch]
            if found and len(frames) - found[0] >= batches:
                return b"".join(map(_payload, frames[found[0]:found[0] + batches]))
            if found and time.monotonic() > end - WITHIN_S + 1.0:
                batches = 1
            time.sleep(0.01)
        raise AssertionError(f"no batch with {marker!r} among {self.batches}")


def _payload(batch: bytes) -> bytes:
    """Return a FRAME without header, sequence number and priority."""
    at = 1
    while batch[at] & 0x80:
        at += 1
    return batch[at + 1 + (2 if batch[0] & 0x80 else 0):]


def _config(listen: list[str], connect: list[str]) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in (("mode", "peer"), ("scouting/multicast/enabled", False), ("scouting/gossip/enabled", False),
                       ("listen/endpoints", listen), ("connect/endpoints", connect)):
        config.insert_json5(key, json.dumps(value))
    return config


@pytest.fixture(scope="module")
def wire() -> Iterator[Wire]:
    wire = Wire()
    everything = wire.listener.declare_subscriber("**", lambda sample: None)

    def answer(query: zenoh.Query) -> None:
        if query.key_expr == zenoh.KeyExpr("q/err"):
            query.reply_err("no", encoding="text/plain")
        elif query.key_expr == zenoh.KeyExpr("q/del"):
            query.reply_del("q/del", attachment=b"gone")
        else:
            query.reply(query.key_expr, b"yes!", attachment=b"at")

    queryable = wire.listener.declare_queryable("**", answer)
    deadline = time.monotonic() + WITHIN_S
    probe = wire.caller.declare_publisher("probe")
    asker = wire.caller.declare_querier("probe")
    while not (probe.matching_status.matching and asker.matching_status.matching):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    yield wire
    everything.undeclare()
    queryable.undeclare()
    wire.close()


def put(key: str, payload: bytes | str, **options: object) -> Callable[[zenoh.Session], None]:
    return lambda session: session.put(key, payload, **options)         # type: ignore[arg-type]


@pytest.mark.parametrize(("act", "ours"), [
    (put("a/plain", b"hello"), Push("a/plain", Data(b"hello"))),
    (put("a/empty", b""), Push("a/empty", Data())),
    (put("a/long", bytes(300)), Push("a/long", Data(bytes(300)))),
    (put("a/attached", "hi", encoding="text/plain", attachment=b"att"),
     Push("a/attached", Data(b"hi", "text/plain", b"att"))),
    (put("a/schema", "hi", encoding="text/plain;foo"), Push("a/schema", Data(b"hi", "text/plain;foo"))),
    (put("a/own", "hi", encoding="my/own"), Push("a/own", Data(b"hi", "my/own"))),
    (put("a/qos", "hi", priority=zenoh.Priority.REAL_TIME, express=True,
         congestion_control=zenoh.CongestionControl.BLOCK), Push("a/qos", Data(b"hi"), Qos(1, True, True))),
    (lambda session: session.delete("a/gone", attachment=b"q"), Push("a/gone", Data(attachment=b"q", deletes=True))),
], ids=lambda value: value.key if isinstance(value, Push) else "")
def test_puts_and_deletes(wire: Wire, act: Callable[[zenoh.Session], None], ours: Push) -> None:
    theirs = wire.of(lambda: act(wire.caller), ours.key.encode())

    assert theirs == encode(ours)
    assert decode(theirs) == [ours]


def test_a_timestamp(wire: Wire) -> None:
    stamp = wire.caller.new_timestamp()

    theirs = wire.of(lambda: wire.caller.put("a/stamped", b"t", timestamp=stamp), b"a/stamped")

    ours = Stamp(int(str(stamp.get_time_as_ntp64())), bytes(stamp.get_id()))
    assert theirs == encode(Push("a/stamped", Data(b"t", stamp=ours)))


def test_every_encoding_has_its_number(wire: Wire) -> None:
    for number, name in enumerate(ENCODINGS):
        key = f"e/{number}/x"
        theirs = wire.of(lambda key=key, name=name: wire.caller.put(key, b"p", encoding=name), key.encode())

        assert theirs == encode(Push(key, Data(b"p", name)))
    known = {str(getattr(zenoh.Encoding, name)) for name in dir(zenoh.Encoding) if name.isupper()}
    assert known == set(ENCODINGS)


@pytest.mark.parametrize(("options", "ours"), [
    ({"selector": "q/a"}, Request(0, "q/a", consolidation=3)),
    ({"selector": "q/b?x=1;y", "payload": "pp", "attachment": "at", "timeout": 3.0},
     Request(0, "q/b", "x=1;y", consolidation=3, timeout_ms=3000, payload=b"pp", attachment=b"at")),
    ({"selector": "q/c", "target": zenoh.QueryTarget.ALL, "consolidation": zenoh.ConsolidationMode.NONE},
     Request(0, "q/c", target=1, consolidation=1)),
    ({"selector": "q/d", "payload": b"v", "encoding": "text/plain", "priority": zenoh.Priority.DATA_HIGH,
      "accept_replies": zenoh.ReplyKeyExpr.ANY, "consolidation": zenoh.ConsolidationMode.MONOTONIC},
     Request(0, "q/d", "_anyke", consolidation=2, payload=b"v", encoding="text/plain", qos=Qos(4, True))),
], ids=["plain", "parameters", "all", "value"])
def test_queries(wire: Wire, options: dict[str, object], ours: Request) -> None:
    theirs = wire.of(lambda: list(wire.caller.get(**options)), ours.key.encode() + b"\xa1")    # type: ignore[arg-type]

    (read,) = (each for each in decode(theirs) if isinstance(each, Request))      # the final of another may be with it
    assert Request(read.number, *_rest(ours)) == read
    assert encode(read) in theirs


@pytest.mark.parametrize(("key", "data", "error"), [
    ("q/reply", Data(b"yes!", attachment=b"at"), False),
    ("q/err", Data(b"no", "text/plain"), True),
    ("q/del", Data(attachment=b"gone", deletes=True), False),
])
def test_replies_and_their_final(wire: Wire, key: str, data: Data, error: bool) -> None:
    theirs = wire.of(lambda: list(wire.caller.get(key)), bytes([0, len(key)]) + key.encode() + b"\xa1\x0d\x43")

    messages = decode(theirs)

    first = messages[0]
    assert isinstance(first, Response)
    assert (first.key, first.data, first.error, first.qos) == (key, data, error, Qos(5, True))
    assert len(first.session) == 16
    assert b"".join(map(encode, messages)) == theirs
    assert all(isinstance(message, ResponseFinal) for message in messages[1:])


@pytest.mark.parametrize(("declare", "entity", "complete"), [
    (lambda session: session.declare_subscriber("d/sub", lambda sample: None), Entity.SUBSCRIBER, False),
    (lambda session: session.declare_queryable("d/qbl", lambda query: None, complete=True), Entity.QUERYABLE, True),
    (lambda session: session.liveliness().declare_token("d/tok"), Entity.TOKEN, False),
], ids=["subscriber", "queryable", "token"])
def test_declarations(wire: Wire, declare: Callable[[zenoh.Session], object], entity: Entity, complete: bool) -> None:
    kept = []
    key = f"d/{ {Entity.SUBSCRIBER: 'sub', Entity.QUERYABLE: 'qbl', Entity.TOKEN: 'tok'}[entity]}"

    theirs = wire.of(lambda: kept.append(declare(wire.caller)), key.encode(), batches=2)

    # Theirs: the declaration of the key with a number, then that of the entity, which names the key by its number.
    keys, entities = theirs.split(b"\x9e\x21\x08")[1:]
    number, scope = entities[1], entities[2]
    assert keys == bytes([0x20, scope, 0, len(key)]) + key.encode()
    ours = encode(Declare(entity, number, key, complete))[3:]
    assert ours.replace(bytes([0, len(key)]) + key.encode(), bytes([scope]))[1:] == entities[1:]
    assert ours[0] ^ entities[0] == 0x20            # ours has the key in full, theirs its number


def test_fragments(wire: Wire) -> None:
    wire.batches.clear()
    long = Push("f/long", Data(bytes(150_000)))
    wire.caller.put("f/long", bytes(150_000))
    deadline = time.monotonic() + WITHIN_S
    while sum(batch[0] & 0x1F == FRAGMENT for batch in wire.batches) < 4:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    theirs = [batch for batch in wire.batches if batch[0] & 0x1F == FRAGMENT]

    last = next(place for place in range(1, 6) if theirs[0][place] < 0x80)      # one session in 128 begins with 3 bytes
    number = sum((theirs[0][place] & 0x7F) << 7 * (place - 1) for place in range(1, last + 1))
    ours = ZenohSender(1, len(theirs[0]) + 4, first_number=number).frames([long])

    assert [frame[4:] for frame in ours] == theirs


def _rest(request: Request) -> tuple[object, ...]:
    return (request.key, request.parameters, request.target, request.consolidation, request.timeout_ms,
            request.payload, request.encoding, request.attachment, request.qos)
