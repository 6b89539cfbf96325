"""A Zenoh session of a program in virtual time, on the media of its node."""

from __future__ import annotations

import json
from types import TracebackType
from typing import Any, Self

from firmware_sim.blocking.here import running, this_program
from firmware_sim.blocking.seconds import duration_ns
from firmware_sim.zenoh_programs.asking import Asking
from firmware_sim.zenoh_programs.channels import open_sink
from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.entities import Publisher, Querier, Queryable, Subscriber
from firmware_sim.zenoh_programs.get_options import GetOptions
from firmware_sim.zenoh_programs.identifiers import EntityGlobalId, ZenohId
from firmware_sim.zenoh_programs.liveliness import Liveliness
from firmware_sim.zenoh_programs.local_entity import LocalEntity, Owned
from firmware_sim.zenoh_programs.matching import Watch
from firmware_sim.zenoh_programs.outside_subset import NoMedium, OutsideSubset, refuse, refuse_given
from firmware_sim.zenoh_programs.real import (
    MODULE,
    ConsolidationMode,
    Encoding,
    KeyExpr,
    Locality,
    QueryConsolidation,
    QueryTarget,
    Reliability,
    ReplyKeyExpr,
    Selector,
    Timestamp,
    ZError,
)
from firmware_sim.zenoh_programs.specification import ZenohSpecification
from firmware_sim.zenoh_programs.station import Station
from firmware_sim.zenoh_programs.tokens import Listener
from firmware_sim.zenoh_programs.values import (
    attachment_of,
    encoding_of,
    key_of,
    payload_of,
    qos_of,
    stamp_of,
    timestamp_of,
)
from netem.wire.zenoh_messages import OF_QUERIES, USUAL, Data, Entity, Push, Qos, Request
from netem.wire.zenoh_timing import MS

SCOUTING_MS = 500               # the library's default of scouting/delay
QUERIES_MS = 10_000             # the library's default of queries_default_timeout
TARGETS = [QueryTarget.BEST_MATCHING, QueryTarget.ALL, QueryTarget.ALL_COMPLETE]     # by their numbers in messages
CONSOLIDATIONS = [ConsolidationMode.AUTO, ConsolidationMode.NONE, ConsolidationMode.MONOTONIC, ConsolidationMode.LATEST]


class SessionInfo(StandIn):
    """`peers_zid`: the nodes of which this one knows a declaration."""

    real = MODULE.SessionInfo

    def __init__(self, session: Session) -> None:
        self._session = session

    def zid(self) -> ZenohId:
        return self._session.zid()

    def routers_zid(self) -> list[ZenohId]:
        return []

    def peers_zid(self) -> list[ZenohId]:
        station = self._session.station
        return [ZenohId(station.identifier_at(address)) for address in station.known.addresses()]

    def __getattr__(self, name: str) -> Any:
        refuse(f"SessionInfo.{name}")


class Session(StandIn):
    real = MODULE.Session

    def __init__(self, station: Station, queries_ns: int, *, stamps: bool) -> None:
        self.station = station
        self.closed = False
        self.entities: list[LocalEntity] = []
        self.watches: list[Watch] = []
        self.listeners: list[Listener] = []         # of liveliness
        self._queries_ns = queries_ns
        self._stamps = stamps                       # True: every put without a timestamp gets one
        self._number = station.next_number()
        station.sessions.append(self)

    # --- itself

    @property
    def info(self) -> SessionInfo:
        return SessionInfo(self)

    @property
    def id(self) -> EntityGlobalId:
        return self.id_of(self._number)

    def zid(self) -> ZenohId:
        return ZenohId(self.station.identifier)

    def id_of(self, number: int) -> EntityGlobalId:
        return EntityGlobalId(self.zid(), number)

    def next_id(self) -> EntityGlobalId:
        return self.id_of(self.station.next_number())

    def close(self) -> None:
        if self.closed:
            return
        self.closed = True
        for watch in self.watches:
            watch.sink.close()
        for listener in list(self.listeners):
            self.forget(listener)
        self.station.leave(self)

    def is_closed(self) -> bool:
        return self.closed

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 where: TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Session(Session {{ id: {self.zid()} }})"

    def check_open(self) -> None:
        """Raise ZError if the session is closed, OutsideSubset in a thread that is none of its program."""
        if self.closed:
            raise ZError("session closed")
        if running() is not self.station.program:
            raise OutsideSubset("zenoh: a call in a thread that the node does not know; start threads with "
                                "threading.Thread")

    def new_timestamp(self) -> Timestamp:
        stamp = timestamp_of(self.station.clock.stamp())
        assert stamp is not None
        return stamp

    def declare_keyexpr(self, key_expr: Any) -> KeyExpr:
        """Return the key expression; messages carry it in full all the same."""
        self.check_open()
        return key_of(key_expr)

    def undeclare(self, obj: Any) -> None:
        self.check_open()
        if isinstance(obj, Owned):
            obj.undeclare()
        elif not isinstance(obj, KeyExpr):
            raise TypeError(f"argument 'obj': '{type(obj).__name__}' is nothing that a session declares")

    def forget(self, listener: Listener) -> None:
        """End a liveliness subscriber."""
        self.listeners.remove(listener)
        self.station.tokens.listeners.remove(listener)
        listener.sink.close()

    # --- publications

    def put(self, key_expr: Any, payload: Any, *, encoding: Any = None, congestion_control: Any = None,
            priority: Any = None, express: Any = None, attachment: Any = None, timestamp: Any = None,
            timestamp_instrumentation: Any = None, allowed_destination: Locality | None = None,
            source_info: Any = None) -> None:
        refuse_given("put", timestamp_instrumentation=timestamp_instrumentation, source_info=source_info)
        key = key_of(key_expr)
        data = Data(payload_of(payload), str(encoding_of(encoding, Encoding.ZENOH_BYTES)), attachment_of(attachment),
                    stamp_of(timestamp))
        self.check_open()
        self.push(key, data, qos_of(priority, congestion_control, express, USUAL), allowed_destination)

    def delete(self, key_expr: Any, *, congestion_control: Any = None, priority: Any = None, express: Any = None,
               attachment: Any = None, timestamp: Any = None, timestamp_instrumentation: Any = None,
               allowed_destination: Locality | None = None, source_info: Any = None) -> None:
        refuse_given("delete", timestamp_instrumentation=timestamp_instrumentation, source_info=source_info)
        key = key_of(key_expr)
        data = Data(attachment=attachment_of(attachment), stamp=stamp_of(timestamp), deletes=True)
        self.check_open()
        self.push(key, data, qos_of(priority, congestion_control, express, USUAL), allowed_destination)

    def push(self, key: KeyExpr, data: Data, qos: Qos, destination: Locality | None) -> None:
        if self._stamps and data.stamp is None:
            data = Data(data.payload, data.encoding, data.attachment, self.station.clock.stamp(), data.deletes)
        self.station.push(self, Push(str(key), data, qos), key, destination or Locality.ANY)
        self.station.program.note_call()

    def declare_publisher(self, key_expr: Any, *, encoding: Any = None, congestion_control: Any = None,
                          priority: Any = None, express: Any = None, reliability: Reliability | None = None,
                          allowed_destination: Locality | None = None) -> Publisher:
        key = key_of(key_expr)
        self.check_open()
        return Publisher(self, key, encoding_of(encoding, Encoding.ZENOH_BYTES),
                         qos_of(priority, congestion_control, express, USUAL), reliability or Reliability.RELIABLE,
                         allowed_destination or Locality.ANY)

    def declare_subscriber(self, key_expr: Any, handler: Any = None, *,
                           allowed_origin: Locality | None = None) -> Subscriber:
        entity, given, goes_on = self._declare(Entity.SUBSCRIBER, key_expr, handler, "Sample", allowed_origin)
        return Subscriber(self, entity, given, goes_on=goes_on)

    # --- queries

    def declare_queryable(self, key_expr: Any, handler: Any = None, *, complete: bool | None = None,
                          allowed_origin: Locality | None = None) -> Queryable:
        entity, given, goes_on = self._declare(Entity.QUERYABLE, key_expr, handler, "Query", allowed_origin,
                                               bool(complete))
        return Queryable(self, entity, given, goes_on=goes_on)

    def get(self, selector: Any, handler: Any = None, *, target: QueryTarget | None = None, consolidation: Any = None,
            accept_replies: ReplyKeyExpr | None = None, timeout: float | None = None, congestion_control: Any = None,
            priority: Any = None, express: Any = None, payload: Any = None, encoding: Any = None,
            attachment: Any = None, allowed_destination: Locality | None = None, source_info: Any = None,
            cancellation_token: Any = None, timestamp_instrumentation: Any = None) -> Any:
        refuse_given("get", source_info=source_info, cancellation_token=cancellation_token,
                     timestamp_instrumentation=timestamp_instrumentation)
        asked = selector if isinstance(selector, Selector) else Selector(selector)
        self.check_open()
        options = self._options(target, consolidation, accept_replies, timeout, congestion_control, priority, express,
                                allowed_destination)
        return self.ask(asked.key_expr, str(asked.parameters), handler, options, payload, encoding, attachment)

    def declare_querier(self, key_expr: Any, *, target: QueryTarget | None = None, consolidation: Any = None,
                        accept_replies: ReplyKeyExpr | None = None, timeout: float | None = None,
                        congestion_control: Any = None, priority: Any = None, express: Any = None,
                        allowed_destination: Locality | None = None) -> Querier:
        key = key_of(key_expr)
        self.check_open()
        return Querier(self, key, self._options(target, consolidation, accept_replies, timeout, congestion_control,
                                                priority, express, allowed_destination))

    def ask(self, key: KeyExpr, parameters: str, handler: Any, options: GetOptions, payload: Any, encoding: Any,
            attachment: Any) -> Any:
        """Send a query; return the handler's receiving end."""
        station = self.station
        sink, given, _ = open_sink(station.program, handler, "Reply")
        consolidation = options.consolidation
        if consolidation == ConsolidationMode.AUTO:
            ranged = any(part.partition("=")[0] == "_time" for part in parameters.split(";"))
            consolidation = ConsolidationMode.NONE if ranged else ConsolidationMode.LATEST
        if options.accept == ReplyKeyExpr.ANY:
            parameters = f"{parameters};_anyke" if parameters else "_anyke"
        number = station.next_request()
        value = None if payload is None else payload_of(payload)
        request = Request(number, str(key), parameters, TARGETS.index(options.target),
                          CONSOLIDATIONS.index(consolidation), options.timeout_ns // MS, value,
                          str(encoding_of(encoding, Encoding.ZENOH_BYTES)), attachment_of(attachment), options.qos)
        station.ask(self, request, key, Asking(consolidation, sink), options)
        station.program.note_call()
        return given

    def liveliness(self) -> Liveliness:
        return Liveliness(self)

    def _options(self, target: QueryTarget | None, consolidation: Any, accept: ReplyKeyExpr | None,
                 timeout: float | None, congestion: Any, priority: Any, express: Any,
                 destination: Locality | None) -> GetOptions:
        if isinstance(consolidation, QueryConsolidation):
            consolidation = consolidation.mode
        return GetOptions(target or QueryTarget.BEST_MATCHING, consolidation or ConsolidationMode.AUTO,
                          accept or ReplyKeyExpr.MATCHING_QUERY,
                          self._queries_ns if timeout is None else duration_ns(timeout),
                          qos_of(priority, congestion, express, OF_QUERIES), destination or Locality.ANY)

    def _declare(self, kind: Entity, key_expr: Any, handler: Any, of: str, origin: Locality | None,
                 complete: bool = False) -> tuple[LocalEntity, Any, bool]:
        key = key_of(key_expr)
        self.check_open()
        sink, given, goes_on = open_sink(self.station.program, handler, of)
        entity = LocalEntity(self, kind, self.station.next_number(), key, origin, complete, sink)
        self.station.declare(entity)
        return entity, given, goes_on


def open_session(specification: ZenohSpecification, config: Any, *, timestamp_callback: Any = None) -> Session:
    """Open a session of the calling program; it waits for `scouting/delay` of the config, as the library does.

    Of the config it uses scouting/delay, queries_default_timeout, transport/link/tx/lease and keep_alive, mode and
    timestamping/enabled; end points and the rest say how to reach others outside, and here the medium does.
    """
    refuse_given("open", timestamp_callback=timestamp_callback)
    program = this_program()
    if specification.problem:
        raise NoMedium(specification.problem)
    lease_ms = _setting(config, "transport/link/tx/lease", 10_000)
    station = program.shared.get(("zenoh", ""))
    if station is None:
        keep_alive_ms = lease_ms / max(1, _setting(config, "transport/link/tx/keep_alive", 4))
        station = Station(program, specification, int(lease_ms * MS), int(keep_alive_ms * MS))
        program.shared["zenoh", ""] = station
    delay_ns = int(_setting(config, "scouting/delay", SCOUTING_MS) * MS)
    session = Session(station, int(_setting(config, "queries_default_timeout", QUERIES_MS) * MS),
                      stamps=_stamps(config))
    station.ask_for_declarations(delay_ns)
    program.sleep(delay_ns)
    return session


def _setting(config: Any, key: str, otherwise: float) -> float:
    value = json.loads(config.get_json(key))
    return otherwise if value is None else float(value)


def _stamps(config: Any) -> bool:
    enabled = json.loads(config.get_json("timestamping/enabled"))
    if isinstance(enabled, dict):
        return bool(enabled.get(json.loads(config.get_json("mode")) or "peer", False))
    return bool(enabled)
