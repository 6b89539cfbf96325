"""The adapter to Eclipse Zenoh 1.x for a gateway: a session in router mode to which a robot's programs connect.

    programs --Zenoh--> session --callbacks--> heard      self-pipe wakes the run, which takes what was heard
    run --actions--> thread `zenoh out` --> session       puts, replies and declarations, which may wait

- What other robots have declared the session declares too, as mirrors, so it is sent what they want, and no more.
  A mirror takes messages of the programs alone, never those of this session, so nothing goes round.
- Callbacks only note what they are given: no call of Zenoh, nothing that waits.
- What the programs have declared, the session's administration space tells; it is read every `LOOK_S` while a program
  is connected, every `LOOK_SOON_S` for `SOON_S` after one has come, gone or changed a token. Whether a queryable is
  complete, a querier's matching status tells.
- A second session, a client, reads it. Zenoh 1.10 locks up when the session asks itself while another thread changes
  its declarations; so the question comes by the connection, and is answered in the one thread in which all connections
  are served (zenoh_runtime.py), while `zenoh out`, which waits for the answer, declares nothing.
- Several programs in client mode hear each other through the session. Programs in peer mode find each other by gossip.
"""

from __future__ import annotations

import json
import os
import queue
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any, Final, NamedTuple

from netem.wire.zenoh_runtime import ONE_THREAD

os.environ.setdefault("ZENOH_RUNTIME", ONE_THREAD)

import zenoh
from zenoh.handlers import Callback

from netem.wire.zenoh_messages import ENCODINGS, Data, Entity, Push, Qos, Request, Response, Stamp

LOOK_S: Final = 0.1             # from one reading of the administration space to the next
LOOK_SOON_S: Final = 0.02       # the same within `SOON_S` after a program has come, gone or changed a token
SOON_S: Final = 1.0
STALLED_US: Final = 1_000_000   # a program that takes nothing for so long is disconnected
STRANGERS_WITHIN_MS: Final = 3_000      # time after which a connection that says nothing is closed
MOST_WAITING: Final = 20_000    # messages that wait, in each direction; those beyond are dropped and counted
LONGEST_MESSAGE: Final = 2**24  # bytes of a message of a program
CLOSE_WITHIN_S: Final = 2.0
# The library's enumerations are not hashable, so these are lists; a priority's number is its place, from 1 on.
PRIORITIES: Final = [zenoh.Priority.REAL_TIME, zenoh.Priority.INTERACTIVE_HIGH, zenoh.Priority.INTERACTIVE_LOW,
                     zenoh.Priority.DATA_HIGH, zenoh.Priority.DATA, zenoh.Priority.DATA_LOW, zenoh.Priority.BACKGROUND]
TARGETS: Final = [zenoh.QueryTarget.BEST_MATCHING, zenoh.QueryTarget.ALL, zenoh.QueryTarget.ALL_COMPLETE]
KINDS: Final = {"subscriber": Entity.SUBSCRIBER, "queryable": Entity.QUERYABLE, "token": Entity.TOKEN}
TIMEOUT: Final = b"Timeout"     # of the library's own error at the time-out of a query
ANY_KEY: Final = "_anyke"       # parameter of a query that takes replies with other keys


class Declared(NamedTuple):
    """An entity, whoever has declared it. `complete`: of a queryable."""

    entity: Entity
    key: str
    complete: bool = False


class Published(NamedTuple):
    """A put or delete of a program, which a mirror of a subscriber has taken."""

    mirror: Declared
    sample: Any


class Asked(NamedTuple):
    """A query of a program, which a mirror of a queryable has taken; it stays open until `Endpoint.end`."""

    mirror: Declared
    query: Any


class Mirrored(NamedTuple):
    """A mirror takes messages from now on."""

    mirror: Declared


class Replied(NamedTuple):
    """A program's reply to a request that the endpoint was told to ask; `reply` None: the last one has come."""

    tag: tuple[int, int]
    reply: Any


class Declares(NamedTuple):
    """What the programs have declared now, all of them together."""

    all: frozenset[Declared]


class Linked(NamedTuple):
    """A program is connected, or is no more."""

    address: str
    identifier: str
    connected: bool


Heard = Published | Asked | Mirrored | Replied | Declares | Linked


class Endpoint:
    """`listen` is an endpoint such as tcp/127.0.0.1:7447; `ways` are the key expressions to carry.

    Raises OSError if it cannot listen. All methods return at once, apart from `close`.
    """

    def __init__(self, listen: str, ways: Sequence[str], most_clients: int) -> None:
        self.overflowed = 0         # messages dropped as too many waited
        self.failed = 0             # messages that the library did not take
        self._ways = ways
        self._waiting: deque[Heard] = deque()
        self._readable, self._writable = os.pipe()
        for end in (self._readable, self._writable):
            os.set_blocking(end, False)
        self._woken = False
        self._actions: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._mirrors: dict[Declared, Any] = {}
        self._queriers: dict[str, Any] = {}
        self._links = 0
        self._changed = False       # a program has come, gone or changed a token
        self._known: frozenset[Declared] = frozenset()
        self._asker_id = f"{secrets.randbits(120) | 1:x}"
        try:
            self._session = zenoh.open(_config(listen, most_clients + 1))
        except zenoh.ZError as error:
            self._close_pipe()
            raise OSError(str(error)) from error
        self._admin = f"@/{self._session.zid()}/router"
        self._locators = self._find_locators()
        self._asker = zenoh.open(_asking(self._locators[0], self._asker_id))
        self._listeners: list[Any] = [self._session.info.declare_link_events_listener(
            _directly(self._link), history=True)]
        for way in ways:
            self._listeners.append(self._session.liveliness().declare_subscriber(
                way, _directly(lambda sample: self._look_soon())))
        self._thread = threading.Thread(target=self._run, name="zenoh out", daemon=True)
        self._thread.start()

    def _find_locators(self) -> list[str]:
        for reply in self._session.get(self._admin):        # nobody is connected yet
            if reply.ok is not None and str(reply.ok.key_expr) == self._admin:
                return [str(locator) for locator in json.loads(reply.ok.payload.to_bytes())["locators"]]
        raise OSError("Zenoh listens nowhere")

    def locators(self) -> list[str]:
        """Return the endpoints at which programs can connect."""
        return self._locators

    def fileno(self) -> int:
        return self._readable

    def take(self) -> Heard | None:
        """Return what was heard next, None if there is no more; the descriptor is silent from then on."""
        if self._waiting:
            return self._waiting.popleft()
        self._woken = False
        with suppress(BlockingIOError):
            os.read(self._readable, 4096)
        return self._waiting.popleft() if self._waiting else None

    def wake(self) -> None:
        """Make the descriptor readable."""
        if not self._woken:
            self._woken = True
            with suppress(BlockingIOError):
                os.write(self._writable, b"\0")

    # --- to the programs

    def put(self, push: Push) -> bool:
        """Publish to the programs; False if too many messages wait, and this one is dropped."""
        return self._message(lambda: self._put(push))

    def reply(self, query: Any, response: Response) -> bool:
        """Reply to a program's query; False as with `put`."""
        return self._message(lambda: _reply(query, response))

    def ask(self, request: Request, tag: tuple[int, int]) -> bool:
        """Ask the programs; `Replied` with this tag follow, the last one with None. False as with `put`."""
        return self._message(lambda: self._ask(request, tag))

    def end(self, query: Any) -> None:
        """Tell the program that no more replies to its query follow."""
        self._actions.put(query.drop)

    def mirror(self, mirror: Declared) -> None:
        self._actions.put(lambda: self._declare(mirror))

    def unmirror(self, mirror: Declared) -> None:
        self._actions.put(lambda: self._undeclare(mirror))

    def close(self) -> None:
        """Send what waits and close the session, within `CLOSE_WITHIN_S`."""
        self._actions.put(None)
        self._thread.join(CLOSE_WITHIN_S)
        for session in (self._asker, self._session):
            closing = threading.Thread(target=session.close, name="closing Zenoh", daemon=True)
            closing.start()
            closing.join(CLOSE_WITHIN_S)
        self._close_pipe()

    def _close_pipe(self) -> None:
        readable, writable, self._readable, self._writable = self._readable, self._writable, -1, -1
        os.close(readable)
        os.close(writable)

    # --- callbacks of the library, in its thread

    def _hear(self, heard: Heard) -> None:
        self._waiting.append(heard)
        if self._writable >= 0:
            with suppress(OSError):             # of a pipe that was closed since
                self.wake()

    def _hear_message(self, heard: Published | Asked | Replied) -> None:
        if len(self._waiting) < MOST_WAITING:
            self._hear(heard)
            return
        self.overflowed += 1
        if isinstance(heard, Asked):
            self._actions.put(heard.query.drop)

    def _link(self, event: Any) -> None:
        link, connected = event.link, event.kind == zenoh.SampleKind.PUT
        if str(link.zid) != self._asker_id:
            self._links += 1 if connected else -1
            self._hear(Linked(str(link.dst), str(link.zid), connected))
            self._look_soon()

    def _look_soon(self) -> None:
        if not self._changed:
            self._changed = True
            self._actions.put(_nothing)

    # --- the thread that calls the library

    def _run(self) -> None:
        looking = self._look()
        wait_s = next(looking)
        while True:
            action: Callable[[], None] | None = _nothing
            with suppress(queue.Empty):
                action = self._actions.get(timeout=wait_s)
            if action is None:
                return
            try:
                action()
            except (zenoh.ZError, ValueError):          # a key that is none, a program that has gone
                self.failed += 1
            wait_s = next(looking)

    def _look(self) -> Iterator[float]:
        """Read what the programs have declared, a bit at each step; yield how long it can wait for the next [s]."""
        soon_until_s = 0.0
        while True:
            begun_s = time.monotonic()
            if self._changed:
                self._changed = False
                soon_until_s = begun_s + SOON_S
            if self._links or begun_s < soon_until_s:
                found: set[tuple[Entity, str]] = set()
                for kind in KINDS:
                    for way in self._ways:
                        found |= self._declared(kind, way)
                        yield 0.0
                self._tell(found)
            while not self._changed and (wait_s := begun_s + self._period_s(soon_until_s) - time.monotonic()) > 0:
                yield wait_s

    def _period_s(self, soon_until_s: float) -> float:
        return LOOK_SOON_S if time.monotonic() < soon_until_s else LOOK_S

    def _declared(self, kind: str, way: str) -> set[tuple[Entity, str]]:
        place, own = f"{self._admin}/{kind}/", str(self._session.zid())
        return {(KINDS[kind], str(reply.ok.key_expr)[len(place):]) for reply in self._asker.get(place + way)
                if reply.ok is not None and _others(reply.ok.payload.to_bytes(), own)}

    def _tell(self, found: set[tuple[Entity, str]]) -> None:
        """Tell what is declared if it has changed."""
        for key in self._queriers.keys() - {key for entity, key in found if entity is Entity.QUERYABLE}:
            self._queriers.pop(key).undeclare()
        known = frozenset(Declared(entity, key, entity is Entity.QUERYABLE and self._is_complete(key))
                          for entity, key in found)
        if known != self._known:
            self._known = known
            self._hear(Declares(known))

    def _is_complete(self, key: str) -> bool:
        if key not in self._queriers:
            self._queriers[key] = self._session.declare_querier(
                key, target=zenoh.QueryTarget.ALL_COMPLETE, allowed_destination=zenoh.Locality.REMOTE)
        return bool(self._queriers[key].matching_status.matching)

    def _message(self, action: Callable[[], None]) -> bool:
        if self._actions.qsize() >= MOST_WAITING:
            return False
        self._actions.put(action)
        return True

    def _put(self, push: Push) -> None:
        data, qos = push.data, push.qos
        given = {"priority": PRIORITIES[qos.priority - 1], "express": qos.express,
                 "congestion_control": zenoh.CongestionControl.BLOCK, "attachment": data.attachment,
                 "timestamp": timestamp_of(data.stamp), "allowed_destination": zenoh.Locality.REMOTE}
        if data.deletes:
            self._session.delete(push.key, **given)
        else:
            self._session.put(push.key, data.payload, encoding=data.encoding, **given)

    def _ask(self, request: Request, tag: tuple[int, int]) -> None:
        selector = f"{request.key}?{request.parameters}" if request.parameters else request.key
        anything = ANY_KEY in request.parameters.split(";")
        self._session.get(
            selector, _directly(lambda reply: self._hear_message(Replied(tag, reply)),
                                lambda: self._hear(Replied(tag, None))),
            target=TARGETS[request.target], consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=zenoh.ReplyKeyExpr.ANY if anything else zenoh.ReplyKeyExpr.MATCHING_QUERY,
            timeout=request.timeout_ms / 1000, payload=request.payload,
            encoding=None if request.payload is None else request.encoding, attachment=request.attachment,
            allowed_destination=zenoh.Locality.REMOTE)

    def _declare(self, mirror: Declared) -> None:
        session, remote = self._session, zenoh.Locality.REMOTE
        match mirror.entity:
            case Entity.SUBSCRIBER:
                self._mirrors[mirror] = session.declare_subscriber(mirror.key, _directly(
                    lambda sample: self._hear_message(Published(mirror, sample))), allowed_origin=remote)
            case Entity.QUERYABLE:
                self._mirrors[mirror] = session.declare_queryable(mirror.key, _directly(
                    lambda query: self._hear_message(Asked(mirror, query))), complete=mirror.complete,
                    allowed_origin=remote)
            case Entity.TOKEN:
                self._mirrors[mirror] = session.liveliness().declare_token(mirror.key)
        self._hear(Mirrored(mirror))

    def _undeclare(self, mirror: Declared) -> None:
        declared = self._mirrors.pop(mirror, None)
        if declared is not None:
            declared.undeclare()


def _directly(callback: Callable[[Any], None], drop: Callable[[], None] | None = None) -> Any:
    """Return a handler that calls `callback` in the library's own thread, without one for each mirror."""
    return Callback(callback, drop, indirect=False)


def _nothing() -> None:
    """Wake the thread."""


def _others(sources: bytes, own: str) -> bool:
    """Return whether somebody besides the session `own` is a source of an entity."""
    listed = json.loads(sources)
    return any(identifier != own for kind in ("peers", "clients") for identifier in listed[kind])


def _reply(query: Any, response: Response) -> None:
    data = response.data
    if response.error:
        query.reply_err(data.payload, encoding=data.encoding)
    elif data.deletes:
        query.reply_del(response.key, attachment=data.attachment, timestamp=timestamp_of(data.stamp))
    else:
        query.reply(response.key, data.payload, encoding=data.encoding, attachment=data.attachment,
                    timestamp=timestamp_of(data.stamp))


def _config(listen: str, most_clients: int) -> zenoh.Config:
    settings = {
        "mode": "router",
        "listen/endpoints": [listen],
        "listen/timeout_ms": 0,
        "listen/exit_on_failure": True,
        "connect/endpoints": [],
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "scouting/gossip/autoconnect": {"router": [], "peer": []},
        "adminspace/enabled": True,
        "adminspace/permissions": {"read": True, "write": False},
        "timestamping/enabled": False,          # what a program sends stays as it is
        "transport/shared_memory/enabled": False,
        "transport/unicast/accept_timeout": STRANGERS_WITHIN_MS,
        "transport/unicast/max_sessions": most_clients,
        "transport/link/rx/max_message_size": LONGEST_MESSAGE,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": STALLED_US,
    }
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


def _asking(connect: str, identifier: str) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in {"mode": "client", "id": identifier, "connect/endpoints": [connect],
                       "scouting/multicast/enabled": False, "scouting/gossip/enabled": False,
                       "transport/shared_memory/enabled": False}.items():
        config.insert_json5(key, json.dumps(value))
    return config


# --- values of the library to those of messages, and back

@lru_cache(maxsize=4096)
def key_expression(text: str) -> zenoh.KeyExpr | None:
    """Return the key expression, None if the text is none."""
    try:
        return zenoh.KeyExpr(text)
    except zenoh.ZError:
        return None


@lru_cache(maxsize=4096)
def intersects(one: str, other: str) -> bool:
    """Return whether two key expressions have a key in common; False for what is none."""
    here, there = key_expression(one), key_expression(other)
    return here is not None and there is not None and here.intersects(there)


@lru_cache(maxsize=4096)
def includes(wide: str, narrow: str) -> bool:
    """Return whether `wide` has all keys of `narrow`; False for what is no key expression."""
    here, there = key_expression(wide), key_expression(narrow)
    return here is not None and there is not None and here.includes(there)


def push_of(sample: Any) -> Push:
    return Push(str(sample.key_expr), data_of(sample), Qos(
        PRIORITIES.index(sample.priority) + 1, sample.congestion_control != zenoh.CongestionControl.DROP,
        sample.express))


def data_of(sample: Any) -> Data:
    attachment, stamp = _bytes(sample.attachment), stamp_of(sample.timestamp)
    if sample.kind == zenoh.SampleKind.DELETE:
        return Data(attachment=attachment, stamp=stamp, deletes=True)
    return Data(sample.payload.to_bytes(), str(sample.encoding), attachment, stamp)


def request_of(query: Any, number: int, target: int, timeout_ms: int) -> Request:
    payload = _bytes(query.payload)
    return Request(number, str(query.key_expr), str(query.parameters), target, 1, timeout_ms, payload,
                   ENCODINGS[0] if payload is None or query.encoding is None else str(query.encoding),
                   _bytes(query.attachment))


def response_of(reply: Any, number: int, key: str) -> Response | None:
    """Return the message of a reply to a query with key expression `key`; None for the library's own time-out."""
    who = reply.replier_id
    session = b"\0" if who is None else _identifier(str(who.zid))
    entity = 0 if who is None else int(who.eid)
    if reply.ok is not None:
        return Response(number, str(reply.ok.key_expr), data_of(reply.ok), session, entity)
    payload = reply.err.payload.to_bytes()
    if who is None and payload == TIMEOUT:
        return None
    return Response(number, key, Data(payload, str(reply.err.encoding)), session, entity, error=True)


def stamp_of(timestamp: Any) -> Stamp | None:
    if timestamp is None:
        return None
    return Stamp(int(str(timestamp.get_time_as_ntp64())), bytes(timestamp.get_id()))


def timestamp_of(stamp: Stamp | None) -> Any:
    """Return the library's timestamp; its fraction of a second is a whole number of nanoseconds, rounded up."""
    if stamp is None:
        return None
    nanoseconds = -(-(stamp.ntp64 & 0xFFFFFFFF) * 10**9 // 2**32)
    return zenoh.Timestamp(zenoh.NTP64(stamp.ntp64 >> 32, min(nanoseconds, 10**9 - 1)),
                           zenoh.TimestampId(stamp.clock))


def _identifier(text: str) -> bytes:
    """Return the bytes of an identifier, which the library writes as a hexadecimal number, the lowest byte first."""
    number = int(text, 16)
    return number.to_bytes(max(1, (number.bit_length() + 7) // 8), "little")


def _bytes(payload: Any) -> bytes | None:
    return None if payload is None else bytes(payload.to_bytes())
