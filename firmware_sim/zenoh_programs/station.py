"""A node on its media, as the Zenoh of its program: what goes out and comes in, for all sessions of the program.

    port --frame--> inbox --thread `zenoh receive`--> messages --> sessions' entities and queries under way
    sessions --messages--> frames --> ports             thread `zenoh timers`: repetitions, leases, time-outs

A put goes out on its medium whether anybody is known to listen or not, as in Zenoh's multicast transport. A query goes
out if a node is known to answer, and ends with the finals of these nodes; so does a query in the library.

Declarations are told three times within 0.4 s, again every `keep_alive_ns`, and when a session asks for them as it
opens; each with a delay drawn at random, so that nodes that do the same at one instant do not collide for ever.

The thread that receives waits for frames all the time, so the node's promise is soft while its program has a session.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from random import Random

from firmware_sim.blocking.inbox import Inbox
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.zenoh_programs.answering import Answering, Query
from firmware_sim.zenoh_programs.asking import Asking
from firmware_sim.zenoh_programs.faces import SessionFace
from firmware_sim.zenoh_programs.get_options import GetOptions
from firmware_sim.zenoh_programs.hybrid_clock import HybridClock
from firmware_sim.zenoh_programs.identifiers import EntityGlobalId, ZenohId, identifier_of
from firmware_sim.zenoh_programs.local_entity import LocalEntity
from firmware_sim.zenoh_programs.neighbours import Known, Neighbours
from firmware_sim.zenoh_programs.outside_subset import NoMedium
from firmware_sim.zenoh_programs.real import KeyExpr, Locality, QueryTarget, ZError
from firmware_sim.zenoh_programs.sample import Sample
from firmware_sim.zenoh_programs.specification import ZenohMedium, ZenohSpecification
from firmware_sim.zenoh_programs.timers import Timers
from firmware_sim.zenoh_programs.tokens import Tokens
from netem.media.packet_network.datagram import EVERYONE as ALL_NODES
from netem.media.packet_network.datagram import Datagram, pack, unpack
from netem.wire.zenoh_frames import EVERYONE, SN_FIRST, SN_MASK, ZenohReceiver, ZenohSender
from netem.wire.zenoh_messages import (
    Declare,
    Entity,
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

HERE = "this node"              # among those that a query waits for
HANDLED_WITHIN_NS = MS          # of a query, from its arrival to the queryables


@dataclass
class Attached:
    """A medium of the node."""

    medium: ZenohMedium
    sender: ZenohSender
    receiver: ZenohReceiver
    keys: list[KeyExpr]
    told: bool = False          # True: declarations are about to be told on request
    incomplete: int = 0         # of the receiver's counter, already counted


class Station:
    """Created when the program opens its first session; `lease_ns` and `keep_alive_ns` are of that session's config."""

    def __init__(self, program: BlockingProgram, specification: ZenohSpecification, lease_ns: int,
                 keep_alive_ns: int) -> None:
        self.program = program
        self.sessions: list[SessionFace] = []
        self.address = specification.names.index(program.node.name) + 1
        self.identifier = identifier_of(program.node.name)
        self.rng = Random(program.board.rng.getrandbits(64))
        self.clock = HybridClock(lambda: program.board.now_ns, self.identifier)
        self.tokens = Tokens()
        self.asking: dict[int, Asking] = {}
        self._names = specification.names
        self._keep_alive_ns = keep_alive_ns
        self._numbers = 0
        self._requests = 0
        self._ways = [(KeyExpr(key), medium) for key, medium in specification.ways]
        self._attached: dict[str, Attached] = {}
        self._gone: list[tuple[int, LocalEntity]] = []      # (until when [ns of the oscillator], former queryable)
        self._lease_ns = lease_ns
        self._inbox: Inbox[Callable[[], None]] = Inbox(program)
        self._timers = Timers(program)
        self.known = Neighbours(lease_ns, self.after, program.oscillator.now_ns, self._appeared, self._vanished)
        for medium in specification.media:
            self._attach(medium)
        threading.Thread(target=self._receive, name="zenoh receive", daemon=True).start()
        self.after(self._shaken(keep_alive_ns), self._keep_alive)

    @property
    def ends(self) -> bool:
        """True from the end of the run on."""
        return self.program.closing or self.program.over

    def identifier_at(self, address: int) -> bytes:
        """Return the identifier of the node with this address."""
        return identifier_of(self._names[address - 1]) if 0 < address <= len(self._names) else bytes([0])

    def next_number(self) -> int:
        self._numbers += 1
        return self._numbers

    def next_request(self) -> int:
        self._requests += 1
        return self._requests

    def after(self, delay_ns: int, action: Callable[[], object]) -> None:
        self._timers.after(delay_ns, action)

    # --- declarations of this node

    def declare(self, entity: LocalEntity) -> None:
        """Tell the other nodes of an entity of this one; raises NoMedium if no medium carries its key."""
        self._media_of(entity.key)
        entity.session.entities.append(entity)
        if entity.entity is Entity.TOKEN:
            self.tokens.add(str(entity.key), entity.key)
        self._look()
        self._tell_thrice(entity.key, lambda: entity.declaration if self._is_declared(entity) else None)

    def undeclare(self, entity: LocalEntity) -> None:
        if entity not in entity.session.entities:
            return
        self._end(entity)
        for attached in self._media_of(entity.key):
            self.send(attached, [entity.undeclaration])
        self._tell_thrice(entity.key, lambda: entity.undeclaration, TOLD_AFTER_NS[1:])

    def leave(self, session: SessionFace) -> None:
        """End all that a session has declared, in as few frames as it takes."""
        entities = list(session.entities)
        for entity in entities:
            self._end(entity)
        for attached in self._attached.values():
            self.send(attached, [entity.undeclaration for entity in entities if _on(attached, entity.key)])
        self.sessions.remove(session)

    def ask_for_declarations(self, within_ns: int) -> None:
        """Ask the other nodes for what they have declared, three times within `within_ns`, at random instants."""
        for third in range(3):
            delay_ns = (third * within_ns + int(self.rng.random() * within_ns)) // 3
            for attached in self._attached.values():
                self.after(delay_ns, partial(self.send, attached, [Interest(self.next_request())]))

    def _end(self, entity: LocalEntity) -> None:
        entity.session.entities.remove(entity)
        if entity.entity is Entity.QUERYABLE:
            self._gone.append((self.program.oscillator.now_ns() + self._lease_ns, entity))
        if entity.sink is not None:
            entity.sink.close()
        if entity.entity is Entity.TOKEN:
            self.tokens.remove(str(entity.key), entity.key)
        self._look()

    def _is_declared(self, entity: LocalEntity) -> bool:
        return entity in entity.session.entities

    def _tell_thrice(self, key: KeyExpr, message: Callable[[], Declare | Undeclare | None],
                     after_ns: Iterable[tuple[int, int]] = TOLD_AFTER_NS) -> None:
        def tell() -> None:
            told = message()
            if told is not None:
                for attached in self._media_of(key):
                    self.send(attached, [told])

        for first_ns, last_ns in after_ns:
            self.after(first_ns + int(self.rng.random() * (last_ns - first_ns)), tell)

    def _keep_alive(self) -> None:
        for attached in self._attached.values():
            self._tell_all(attached)
        self.after(self._shaken(self._keep_alive_ns), self._keep_alive)

    def _tell_all(self, attached: Attached) -> None:
        attached.told = False
        self.send(attached, [entity.declaration for session in self.sessions for entity in session.entities
                             if _on(attached, entity.key)])

    def _shaken(self, period_ns: int) -> int:
        return int(period_ns * (1 + SHAKEN * (2 * self.rng.random() - 1)))

    # --- messages of sessions

    def send(self, attached: Attached, messages: Iterable[Message], to: int = EVERYONE) -> None:
        """Send messages on a medium now, to one node or to all."""
        name = ALL_NODES if to == EVERYONE else self._names[to - 1]
        for frame in attached.sender.frames(messages, to):
            self.program.send(attached.medium.name,
                              pack(Datagram(name, frame)) if attached.medium.addressed else frame)

    def push(self, session: SessionFace, message: Push, key: KeyExpr, destination: Locality) -> None:
        """Send a put or delete to the subscribers of other nodes and of this one."""
        if destination != Locality.SESSION_LOCAL:
            self.send(self._medium_of(key), [message])
        self._deliver(message, key, session, destination)

    def ask(self, session: SessionFace, request: Request, key: KeyExpr, asking: Asking, options: GetOptions) -> None:
        """Send a query to who can answer it; it ends at once if there is nobody."""
        send_to = self._answerers(key, options)
        local = self._local_queryables(session, key, options)
        asking.waits_for.update((medium, address) for medium, addresses in send_to.items() for address in addresses)
        if local:
            asking.waits_for.add(HERE)
        if not asking.waits_for:
            asking.end()
            return
        self.asking[request.number] = asking
        for medium, addresses in send_to.items():
            self.send(self._attached[medium], [request], addresses[0] if len(addresses) == 1 else EVERYONE)
        self.after(options.timeout_ns, partial(self._time_out, request.number))
        if local:
            self._query(Answering(self, request, key, partial(self._answered, of=HERE)), local)

    def has_subscriber(self, session: SessionFace, key: KeyExpr, destination: Locality) -> bool:
        """Return whether a subscriber that such a put would reach is known."""
        return any(self._subscribers(key, session, destination)) or (
            destination != Locality.SESSION_LOCAL
            and any(known.key.intersects(key) for known in self.known.those(Entity.SUBSCRIBER)))

    def has_queryable(self, session: SessionFace, key: KeyExpr, options: GetOptions) -> bool:
        return bool(self._local_queryables(session, key, options) or self._answerers(key, options))

    # --- messages of other nodes

    def _receive(self) -> None:
        while True:
            handle = self._inbox.take(None)
            if handle is not None:
                handle()

    def _take(self, medium: str, data: bytes) -> None:
        attached, node = self._attached[medium], self.program.node
        try:
            if attached.medium.addressed:
                datagram = unpack(data)
                if datagram is None:
                    raise MalformedZenohFrame("no header of a datagram")
                data = datagram.payload
            batch = attached.receiver.take(data)
            if batch.receiver in (EVERYONE, self.address) and batch.sender != self.address:
                for message in batch.messages:
                    self._handle(attached, batch.sender, message)
        except (MalformedZenohFrame, ZError):           # ZError: a key that is no key expression
            node.count(f"{medium}.zenoh_malformed")
        node.count(f"{medium}.zenoh_incomplete", attached.receiver.incomplete - attached.incomplete)
        attached.incomplete = attached.receiver.incomplete

    def _handle(self, attached: Attached, sender: int, message: Message) -> None:
        match message:
            case Push():
                self._deliver(message, KeyExpr(message.key), None, Locality.ANY)
            case Declare():
                self.known.declare(attached.medium.name, sender, message)
            case Undeclare():
                self.known.undeclare(sender, message)
            case Interest():
                if not attached.told:
                    attached.told = True
                    self.after(int(self.rng.random() * ANSWERED_WITHIN_NS), partial(self._tell_all, attached))
            case Request():
                # Not at once: all who answer would send at one instant, and on a radio collide each time.
                handle = partial(self._request, attached, sender, message, KeyExpr(message.key))
                self.after(int(self.rng.random() * HANDLED_WITHIN_NS), partial(self._inbox.put, handle))
            case Response() | ResponseFinal():
                self._answered(message, (attached.medium.name, sender))

    def _request(self, attached: Attached, sender: int, request: Request, key: KeyExpr) -> None:
        """Let the queryables of this node answer; send the final if one has gone that the sender may still count on."""
        complete = request.target == 2
        queryables = [entity for session in self.sessions for entity in session.entities
                      if entity.entity is Entity.QUERYABLE and entity.takes_from(None)
                      and _answers(entity.key, key, entity.complete, complete)]

        def send(message: Response | ResponseFinal) -> None:
            self.send(attached, [message], sender)

        now_ns = self.program.oscillator.now_ns()
        self._gone = [(until_ns, entity) for until_ns, entity in self._gone if until_ns > now_ns]
        if queryables:
            self._query(Answering(self, request, key, send), queryables)
        elif any(_answers(entity.key, key, entity.complete, complete) for _, entity in self._gone):
            send(ResponseFinal(request.number, request.qos))

    def _answered(self, message: Response | ResponseFinal, of: object) -> None:
        asking = self.asking.get(message.number)
        if asking is None:
            return
        if isinstance(message, ResponseFinal):
            asking.final(of)
        else:
            asking.take(message, EntityGlobalId(ZenohId(message.session), message.entity))
        if asking.over:
            del self.asking[message.number]

    # --- on this node

    def _deliver(self, message: Push, key: KeyExpr, session: SessionFace | None, destination: Locality) -> None:
        for entity in list(self._subscribers(key, session, destination)):
            assert entity.sink is not None
            entity.sink.put(Sample(key, message.data, message.qos))

    def _subscribers(self, key: KeyExpr, session: SessionFace | None, destination: Locality) -> Iterator[LocalEntity]:
        """Return the subscribers of this node for a put of `session`, None: of another node."""
        return (entity for each in self.sessions if _reaches(destination, each is session)
                for entity in each.entities if entity.entity is Entity.SUBSCRIBER and entity.takes_from(session)
                and entity.key.intersects(key))

    def _local_queryables(self, session: SessionFace, key: KeyExpr, options: GetOptions) -> list[LocalEntity]:
        complete = options.target == QueryTarget.ALL_COMPLETE
        return [entity for each in self.sessions if _reaches(options.destination, each is session)
                for entity in each.entities if entity.entity is Entity.QUERYABLE and entity.takes_from(session)
                and _answers(entity.key, key, entity.complete, complete)]

    def _answerers(self, key: KeyExpr, options: GetOptions) -> dict[str, list[int]]:
        """Return the addresses of the nodes to ask, by medium; for BEST_MATCHING a complete one, if there is."""
        if options.destination == Locality.SESSION_LOCAL:
            return {}
        complete = options.target == QueryTarget.ALL_COMPLETE
        those = [known for known in self.known.those(Entity.QUERYABLE)
                 if _answers(known.key, key, known.complete, complete)]
        if options.target == QueryTarget.BEST_MATCHING:
            those = [known for known in those if known.complete and known.key.includes(key)][:1] or those
        found: dict[str, list[int]] = {}
        for address in dict.fromkeys(known.address for known in those):
            medium = next(medium for known in those if known.address == address for medium in known.until_ns)
            found.setdefault(medium, []).append(address)
        return found

    def _query(self, answering: Answering, queryables: list[LocalEntity]) -> None:
        for query in [Query(answering, queryable) for queryable in queryables]:
            sink = query.queryable.sink
            assert sink is not None
            sink.put(query)

    def _time_out(self, number: int) -> None:
        if (asking := self.asking.pop(number, None)) is not None:
            asking.time_out()

    def _appeared(self, known: Known) -> None:
        if known.entity is Entity.TOKEN:
            self.tokens.add(known.text, known.key)
        self._look()

    def _vanished(self, known: Known) -> None:
        if known.entity is Entity.TOKEN:
            self.tokens.remove(known.text, known.key)
        self._look()

    def _look(self) -> None:
        for session in self.sessions:
            for watch in list(session.watches):
                watch.look()

    # --- media

    def _attach(self, medium: ZenohMedium) -> None:
        first = SN_FIRST + self.rng.randrange(SN_MASK - SN_FIRST)
        self._attached[medium.name] = Attached(
            medium, ZenohSender(self.address, medium.longest_bytes, first), ZenohReceiver(),
            [key for key, name in self._ways if name == medium.name])
        node = self.program.node
        node.ports[medium.name].on_receive = lambda data: self._arrived(medium.name, data)
        for what in ("zenoh_malformed", "zenoh_incomplete"):
            node.count(f"{medium.name}.{what}", 0)

    def _arrived(self, medium: str, data: bytes) -> None:
        if not self.ends:
            self._inbox.put(partial(self._take, medium, data))

    def _medium_of(self, key: KeyExpr) -> Attached:
        """Return the medium of the first way that intersects `key`; raises NoMedium if there is none."""
        for way, medium in self._ways:
            if way.intersects(key):
                return self._attached[medium]
        raise NoMedium(f"agents.{self.program.node.name}.zenoh: no key expression intersects {str(key)!r}, so no "
                       f"medium carries it; there are {', '.join(f'{str(way)!r}' for way, _ in self._ways)}")

    def _media_of(self, key: KeyExpr) -> list[Attached]:
        """Return all media with a way that intersects `key`; raises NoMedium if there is none."""
        self._medium_of(key)
        return [attached for attached in self._attached.values() if _on(attached, key)]


def _on(attached: Attached, key: KeyExpr) -> bool:
    return any(way.intersects(key) for way in attached.keys)


def _reaches(destination: Locality, same_session: bool) -> bool:
    return destination == Locality.ANY or (destination == Locality.SESSION_LOCAL) == same_session


def _answers(queryable: KeyExpr, key: KeyExpr, complete: bool, only_complete: bool) -> bool:
    """Return whether a queryable takes a query; one for complete answers only if it has all keys of the query."""
    return queryable.includes(key) and complete if only_complete else queryable.intersects(key)
