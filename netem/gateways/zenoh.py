"""A Zenoh endpoint of one robot as a gateway: the programs that connect there are that robot, on one medium.

    program of r1 --put--> endpoint of r1 --frames--> medium --frames--> endpoint of r2 --put--> programs of r2
    declarations of the programs --told thrice, then every lease_ns / 4--> mirrors at the other robots' endpoints

The frames are those of programs in virtual time (netem/wire/zenoh_frames.py), which take part on the same medium. A put
goes out on the medium if a node there is known to subscribe to it, as on a link between two of Zenoh's routers; a query
goes to the nodes that are known to answer it, and ends with their finals. Declarations hold for `lease_ns` from each
time that they are heard, so that liveliness is lost under a partition and comes back. Puts that wait when the run takes
them share frames, as in Zenoh's batches, unless they are express.

Differs from a router: of a query the library does not tell its target and time-out. Where a complete queryable has all
of its keys, all nodes with such a one are asked, else all with a queryable that intersects it; the query stays open for
`query_timeout_ns`, unless its program gives up before. Source information and timestamp stacks are not carried.
"""

from __future__ import annotations

import random
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from ipaddress import ip_address
from itertools import count
from typing import Any, ClassVar, Final

from netem.gateways import (
    GARBAGE,
    GONE,
    SPEAKS,
    UNREAD,
    Datagrams,
    Door,
    Gateway,
    GatewaySettings,
    Tell,
    tell_nobody,
)
from netem.gateways.addresses import address_of, wrong_networks
from netem.gateways.allowance import Allowance
from netem.gateways.private_socket import PrivateSocket
from netem.gateways.tls_front import OpenedDoor
from netem.gateways.zenoh_endpoint import (
    Asked,
    Declared,
    Declares,
    Endpoint,
    Linked,
    Mirrored,
    Published,
    Replied,
    intersects,
    key_expression,
    push_of,
    request_of,
    response_of,
)
from netem.gateways.zenoh_others import Others
from netem.gateways.zenoh_own import Own
from netem.wire.level import Level
from netem.wire.zenoh_frames import EVERYONE, LEAST_ROOM, SN_FIRST, SN_MASK, ZenohReceiver, ZenohSender
from netem.wire.zenoh_keys import problem_of
from netem.wire.zenoh_messages import (
    Declare,
    Interest,
    MalformedZenohFrame,
    Message,
    Push,
    Request,
    Response,
    ResponseFinal,
    Undeclare,
)
from netem.wire.zenoh_timing import ANSWERED_WITHIN_NS, MS, SHAKEN, TOLD_AFTER_NS

TCP, TLS = "tcp/", "tls/"
ENDPOINT_RULE: Final = ("expected an endpoint, an IP address and a port after tcp/ or tls/, such as "
                        "\"tcp/127.0.0.1:7447\" or \"tls/192.168.1.5:7447\"")
ASKED_WITHIN_NS: Final = 500 * MS       # this gateway asks three times for what is declared
MOST_OPEN: Final = 1000                 # queries under way in each direction; further ones end at once
MOST_IN_A_BATCH: Final = 100
ALL, ALL_COMPLETE = 1, 2                # targets of a query
USUAL_KEYS: Final = ("**", "**/@adv/**", "@ros2_lv/**")


@dataclass(frozen=True)
class ZenohSettings(GatewaySettings):
    """`keys`: what is carried; `*` and `**` stand for no chunk that begins with @, so such chunks have to be named."""

    listen: str = "tcp/127.0.0.1:7447"      # beyond the loopback only with tls/
    only_from: tuple[str, ...] = ()         # addresses and networks of programs, with tls/; (): any
    keys: tuple[str, ...] = USUAL_KEYS
    lease_ns: int = 10_000_000_000          # declarations are forgotten after so long without a repetition
    query_timeout_ns: int = 60_000_000_000
    most_clients: int = 32
    most_per_s: int = 20_000                # messages of the robot's programs; those beyond are dropped

    def __post_init__(self) -> None:
        wrong = [*self._wrong_endpoint(), *wrong_networks(self.only_from)]
        if self.only_from and not self.has_door:
            wrong.append(f"only_from={list(self.only_from)}: is about a door with TLS; listen with tls/")
        wrong += [f"keys={key}: no key expression: {complaint}" for key in self.keys if (complaint := problem_of(key))]
        wrong += [f"{name}={value}: expected at least {least}" for name, value, least in (
            ("lease_ns", self.lease_ns, 100 * MS), ("query_timeout_ns", self.query_timeout_ns, MS),
            ("most_clients", self.most_clients, 1), ("most_per_s", self.most_per_s, 1)) if value < least]
        if not self.keys:
            wrong.append("keys=[]: nothing would be carried; expected key expressions such as \"**\"")
        if wrong:
            raise ValueError("\n".join(wrong))

    def _wrong_endpoint(self) -> Iterator[str]:
        try:
            host = address_of(self.address)[0]
        except ValueError:
            yield f"listen={self.listen}: {ENDPOINT_RULE}"
            return
        if not self.listen.startswith((TCP, TLS)):
            yield f"listen={self.listen}: {ENDPOINT_RULE}"
        elif not self.has_door and not ip_address(host).is_loopback:
            yield (f"listen={self.listen}: is beyond the loopback, where tcp/ lets anybody be this robot; write "
                   f"listen = \"{TLS}{self.address}\" and [network] tls = \"FOLDER\", with the certificates of "
                   "marconet certificates new FOLDER")

    @property
    def address(self) -> str:
        """The address "host:port" of the endpoint."""
        return self.listen[len(TCP):]

    @property
    def has_door(self) -> bool:
        return self.listen.startswith(TLS)

    def occupies(self) -> Collection[str]:
        return () if address_of(self.address)[1] == 0 else (f"the TCP address {self.address}",)

    def door(self, name: str) -> Door | None:
        """Return the door through which a program with the robot's certificate comes, and nobody else."""
        return Door(self.address, (name,), self.only_from, self.most_clients) if self.has_door else None

    def refusal(self, *, carries_can_frames: bool, datagrams: Datagrams | None) -> str:
        if datagrams is None:
            return "carries no datagrams; Zenoh needs a medium such as broadcast_radio or packet_network"
        if datagrams.longest_bytes is not None and datagrams.longest_bytes < LEAST_ROOM:
            return f"its frames have at most {datagrams.longest_bytes} bytes; Zenoh needs {LEAST_ROOM} at least"
        return ""


@dataclass
class Open:
    """A program's query, with the nodes whose finals are still to come."""

    query: Any
    waits_for: set[int] = field(default_factory=set)


class ZenohGateway(Gateway):
    """A gateway to Zenoh programs.

    Invariants:
    - `received` + "messages beyond the rate" is the number of puts, deletes, queries and replies of the programs that
      go to other nodes;
    - "messages sent" + "messages not sent" is the number of those from other nodes.
    """

    Settings: ClassVar = ZenohSettings
    settings: ZenohSettings

    def __init__(self, name: str, medium: str, settings: ZenohSettings, *, event: Tell = tell_nobody,
                 longest_bytes: int | None = None, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Open the session; raises OSError, with the endpoint and a remedy, if that fails."""
        super().__init__(name, medium, settings, event=event, longest_bytes=longest_bytes, clock_ns=clock_ns)
        self.received = self.flooded = self.sent = self.unsent = self.malformed = self.clients = 0
        self._random = random.Random()
        self._own = Own(settings.lease_ns)
        self._allowance = Allowance(settings.most_per_s, clock_ns())
        self._receiver = ZenohReceiver()
        self._frames: deque[bytes] = deque()                # for the medium
        self._batch: list[Push] = []                        # for the next frames
        self._timers: list[tuple[int, int, Callable[[], None]]] = []
        self._order = count()
        self._open: dict[int, Open] = {}                    # by number of the request
        self._answering: dict[tuple[int, int], Request] = {}    # requests of other nodes, by (address, number)
        self._numbers = count(1)
        self._told_interest = self._told_unread = self._told_garbage = False
        self._door: OpenedDoor | None = None
        self._behind = PrivateSocket() if settings.has_door else None
        listen = settings.listen if self._behind is None else f"unixsock-stream/{self._behind.path}"
        try:
            self._endpoint = Endpoint(listen, settings.keys, settings.most_clients)
        except OSError as error:
            self._close_behind()
            raise OSError(f"gateways.{name}: cannot listen on {settings.listen}: {error}; end the program or run that "
                          "has it, or listen on another port") from error
        self._others = Others(settings.lease_ns, self._endpoint.mirror, self._endpoint.unmirror)

    def join(self, names: Sequence[str], datagrams: Datagrams | None) -> None:
        assert datagrams is not None
        self._names, self._datagrams = names, datagrams
        self._sender = ZenohSender(names.index(self.name) + 1, datagrams.longest_bytes,
                                   self._random.randrange(SN_FIRST, SN_MASK))
        for third in range(3):
            self._after((third + self._random.random()) * ASKED_WITHIN_NS / 3,
                        lambda: self._send([Interest(next(self._numbers))]))
        self._after(self._shaken_ns(), self._keep_alive)

    def locators(self) -> Sequence[str]:
        """Return the endpoints at which programs can connect."""
        return self._endpoint.locators() if self._door is None else [f"{TLS}{self._door.address}"]

    def onward(self) -> str:
        assert self._behind is not None
        return f"unix/{self._behind.path}"

    def opened(self, door: OpenedDoor) -> None:
        self._door = door

    def fileno(self) -> int:
        return self._endpoint.fileno()

    def due_ns(self) -> int:
        """See `Gateway`: the next repetition, or the end of a declaration that was not repeated."""
        expires_ns = self._others.due_ns()
        return min(self._timers[0][0], expires_ns) if self._timers else expires_ns

    def receive(self, most: int) -> list[bytes]:
        now_ns = self._clock_ns()
        while self._timers and self._timers[0][0] <= now_ns:
            heappop(self._timers)[2]()
        self._others.expire(now_ns)
        for _ in range(MOST_IN_A_BATCH):
            heard = self._endpoint.take() if len(self._frames) < most else None
            if heard is None:
                break
            self._hear(heard, now_ns)
        else:
            self._endpoint.wake()
        self._flush()
        found = [self._frames.popleft() for _ in range(min(most, len(self._frames)))]
        if self._frames or len(found) == most:
            self._endpoint.wake()
        return found

    def send(self, data: bytes) -> None:
        inner = self._datagrams.payload_of(data)
        try:
            if inner is None:
                raise MalformedZenohFrame("no header of a datagram")
            batch = self._receiver.take(inner)
        except MalformedZenohFrame as error:
            self._garbage(str(error))
            return
        if batch.receiver in (EVERYONE, self._sender.address) and batch.sender != self._sender.address:
            now_ns = self._clock_ns()
            for message in batch.messages:
                self._take(batch.sender, message, now_ns)

    def counters(self) -> dict[str, int]:
        return {"messages received": self.received,
                "messages beyond the rate": self.flooded + self._endpoint.overflowed,
                "messages sent": self.sent - self._endpoint.failed,
                "messages not sent": self.unsent + self._endpoint.failed, "malformed frames": self.malformed,
                "incomplete messages": self._receiver.incomplete, "connections": self.clients,
                "connections refused": 0 if self._door is None else self._door.refused}

    def close(self) -> None:
        self._endpoint.close()
        self._close_behind()

    def _close_behind(self) -> None:
        if self._behind is not None:
            self._behind.close()

    # --- from the programs

    def _hear(self, heard: Any, now_ns: int) -> None:
        match heard:
            case Published(mirror, sample):
                key = str(sample.key_expr)
                if self._others.counts(mirror, key) and self._carries(key) and self._admit(now_ns):
                    self._batch.append(push_of(sample))
                    if self._batch[-1].qos.express:
                        self._flush()
            case Asked(mirror, query):
                self._ask_others(mirror, query, now_ns)
            case Replied(tag, reply):
                self._answer(tag, reply, now_ns)
            case Mirrored(mirror):
                self._others.confirm(mirror)
            case Declares(declared):
                self._declare(declared, now_ns)
            case Linked(address, identifier, connected):
                self.clients += connected
                if self._behind is None:        # else the door tells it, which knows the address
                    self.tell(SPEAKS if connected else GONE, f"speaks with {address} (Zenoh {identifier})" if connected
                              else f"speaks no more with {address} (Zenoh {identifier})", Level.INFO)

    def _admit(self, now_ns: int) -> bool:
        if self._allowance.take(now_ns):
            self.received += 1
            return True
        self.flooded += 1
        self.tell_flood(self._allowance, f"its programs send more than {self.settings.most_per_s} messages a second; "
                        "those beyond are dropped and counted; raise most_per_s if that is what they should send")
        return False

    def _ask_others(self, mirror: Declared, query: Any, now_ns: int) -> None:
        key = str(query.key_expr)
        if not self._others.counts(mirror, key):
            self._endpoint.end(query)
            return
        complete = mirror.complete and self._others.answerers(key, complete=True)
        nodes = complete or self._others.answerers(key, complete=False)
        if not nodes or len(self._open) >= MOST_OPEN or not self._admit(now_ns):
            self._endpoint.end(query)
            return
        number = next(self._numbers)
        self._open[number] = Open(query, set(nodes))
        request = request_of(query, number, ALL_COMPLETE if complete else ALL, self.settings.query_timeout_ns // MS)
        self._send([request], next(iter(nodes)) if len(nodes) == 1 else EVERYONE)
        self._after(self.settings.query_timeout_ns, lambda: self._end(number))

    def _end(self, number: int) -> None:
        """End a program's query, if it is still open."""
        found = self._open.pop(number, None)
        if found is not None:
            self._endpoint.end(found.query)

    def _answer(self, tag: tuple[int, int], reply: Any, now_ns: int) -> None:
        address, number = tag
        request = self._answering.get(tag)
        if request is None:
            return
        if reply is None:
            del self._answering[tag]
            self._send([ResponseFinal(number, request.qos)], address)
            return
        response = response_of(reply, number, request.key)
        if response is not None and self._admit(now_ns):
            self._send([response], address)

    # --- declarations of the programs

    def _declare(self, declared: Collection[Declared], now_ns: int) -> None:
        new, undeclared = self._own.change(declared, now_ns)
        if undeclared:
            self._send(undeclared)
            self._tell_again(TOLD_AFTER_NS[1:], lambda: undeclared)
        if new:
            self._tell_again(TOLD_AFTER_NS, lambda: [self._own.declaration(each) for each in new if each in self._own])

    def _tell_again(self, after_ns: Iterable[tuple[int, int]], messages: Callable[[], Iterable[Message]]) -> None:
        for first_ns, last_ns in after_ns:
            self._after(first_ns + self._random.random() * (last_ns - first_ns), lambda: self._send(messages()))

    def _keep_alive(self) -> None:
        self._send(self._own.declarations())
        self._after(self._shaken_ns(), self._keep_alive)

    def _tell_all(self) -> None:
        self._told_interest = False
        self._send(self._own.declarations())

    def _shaken_ns(self) -> float:
        return self.settings.lease_ns / 4 * (1 + SHAKEN * (2 * self._random.random() - 1))

    # --- from the medium

    def _take(self, sender: int, message: Message, now_ns: int) -> None:
        match message:
            case Push():
                if self._is_key(message.key) and self._carries(message.key):
                    self._count(self._endpoint.put(message))
            case Declare():
                if self._is_key(message.key) and self._carries(message.key):
                    self._others.declare(sender, message, now_ns)
            case Undeclare():
                self._others.undeclare(sender, message)
            case Interest():
                if not self._told_interest:
                    self._told_interest = True
                    self._after(self._random.random() * ANSWERED_WITHIN_NS, self._tell_all)
            case Request():
                if self._is_key(message.key) and self._carries(message.key):
                    self._request(sender, message, now_ns)
            case Response():
                found = self._open.get(message.number)
                if found is not None and sender in found.waits_for and self._is_key(message.key):
                    self._count(self._endpoint.reply(found.query, message))
            case ResponseFinal():
                found = self._open.get(message.number)
                if found is not None:
                    found.waits_for.discard(sender)
                    if not found.waits_for:
                        self._end(message.number)

    def _request(self, sender: int, request: Request, now_ns: int) -> None:
        complete, tag = request.target == ALL_COMPLETE, (sender, request.number)
        if self._own.answers(request.key, only_complete=complete):
            if tag not in self._answering and len(self._answering) < MOST_OPEN:
                asked = self._endpoint.ask(request, tag)
                self._count(asked)
                if asked:
                    self._answering[tag] = request
        elif self._own.has_answered(request.key, only_complete=complete, now_ns=now_ns):
            self._send([ResponseFinal(request.number, request.qos)], sender)

    def _count(self, taken: bool) -> None:
        if taken:
            self.sent += 1
            return
        self.unsent += 1
        if not self._told_unread:
            self._told_unread = True
            self.tell(UNREAD, "has more messages than its programs read; those beyond are dropped and counted; let the "
                      "programs read faster, or send them less")

    def _is_key(self, key: str) -> bool:
        if key_expression(key) is not None:
            return True
        self._garbage(f"{key[:80]!r} is no key expression")
        return False

    def _garbage(self, why: str) -> None:
        self.malformed += 1
        if not self._told_garbage:
            self._told_garbage = True
            self.tell(GARBAGE, f"drops a frame that is none of Zenoh's: {why}; others on {self.medium} send what this "
                      "gateway cannot read; further ones are counted")

    # --- to the medium

    def _carries(self, key: str) -> bool:
        return any(intersects(way, key) for way in self.settings.keys)

    def _flush(self) -> None:
        """Send the puts that wait to share frames."""
        batch, self._batch = self._batch, []
        if batch:
            self._send(batch)

    def _send(self, messages: Iterable[Message], to: int = EVERYONE) -> None:
        self._flush()
        name = None if to == EVERYONE else self._names[to - 1]
        self._frames.extend(self._datagrams.enclose(name, frame) for frame in self._sender.frames(messages, to))
        if self._frames:
            self._endpoint.wake()

    def _after(self, delay_ns: float, action: Callable[[], None]) -> None:
        heappush(self._timers, (self._clock_ns() + int(delay_ns), next(self._order), action))
