"""Publisher, subscriber, queryable and querier of a session."""

from __future__ import annotations

from typing import Any

from firmware_sim.zenoh_programs.faces import SessionFace
from firmware_sim.zenoh_programs.get_options import GetOptions
from firmware_sim.zenoh_programs.local_entity import LocalEntity, Owned, Receiving
from firmware_sim.zenoh_programs.matching import MatchingListener, MatchingStatus
from firmware_sim.zenoh_programs.outside_subset import refuse_given
from firmware_sim.zenoh_programs.real import (
    MODULE,
    CongestionControl,
    Encoding,
    KeyExpr,
    Locality,
    Priority,
    Reliability,
    ReplyKeyExpr,
)
from firmware_sim.zenoh_programs.values import PRIORITIES, attachment_of, encoding_of, payload_of, stamp_of
from netem.wire.zenoh_messages import Data, Qos


class Sending(Owned):
    """What a publisher and a querier share: a key, and whether anybody there matches it."""

    def __init__(self, session: SessionFace, key: KeyExpr) -> None:
        super().__init__(session)
        self._key = key
        self._id = session.next_id()

    @property
    def id(self) -> Any:
        self._check()
        return self._id

    @property
    def key_expr(self) -> KeyExpr:
        self._check()
        return self._key

    @property
    def matching_status(self) -> MatchingStatus:
        self._check_open()
        self._session.station.program.note_call()
        return MatchingStatus(self._matches())

    def declare_matching_listener(self, handler: Any = None) -> MatchingListener:
        self._check_open()
        return MatchingListener(self._session, self._matches, handler)

    def _matches(self) -> bool:
        raise NotImplementedError

    def _end(self) -> None:
        """Nothing was told to other nodes."""


class Publisher(Sending):
    real = MODULE.Publisher
    called = "publisher"

    def __init__(self, session: SessionFace, key: KeyExpr, encoding: Encoding, qos: Qos, reliability: Reliability,
                 destination: Locality) -> None:
        super().__init__(session, key)
        self._encoding, self._qos = encoding, qos
        self._reliability, self._destination = reliability, destination

    @property
    def encoding(self) -> Encoding:
        self._check()
        return self._encoding

    @property
    def congestion_control(self) -> CongestionControl:
        self._check()
        return CongestionControl.BLOCK if self._qos.block else CongestionControl.DROP

    @property
    def priority(self) -> Priority:
        self._check()
        return PRIORITIES[self._qos.priority - 1]

    @property
    def reliability(self) -> Reliability:
        self._check()
        return self._reliability

    def put(self, payload: Any, *, encoding: Any = None, attachment: Any = None, timestamp: Any = None,
            timestamp_instrumentation: Any = None, source_info: Any = None) -> None:
        refuse_given("put", timestamp_instrumentation=timestamp_instrumentation, source_info=source_info)
        self._check_open()
        self._session.push(self._key, Data(payload_of(payload), str(encoding_of(encoding, self._encoding)),
                                           attachment_of(attachment), stamp_of(timestamp)),
                           self._qos, self._destination)

    def delete(self, *, attachment: Any = None, timestamp: Any = None, timestamp_instrumentation: Any = None,
               source_info: Any = None) -> None:
        refuse_given("delete", timestamp_instrumentation=timestamp_instrumentation, source_info=source_info)
        self._check_open()
        self._session.push(self._key, Data(attachment=attachment_of(attachment), stamp=stamp_of(timestamp),
                                           deletes=True), self._qos, self._destination)

    def _matches(self) -> bool:
        return self._session.station.has_subscriber(self._session, self._key, self._destination)


class Subscriber(Receiving):
    """Of samples, also those of `Liveliness.declare_subscriber`, which nobody else is told of (`end`)."""

    real = MODULE.Subscriber
    called = "subscriber"

    def __init__(self, session: SessionFace, entity: LocalEntity, handler: Any, *, goes_on: bool) -> None:
        super().__init__(session, handler=handler, goes_on=goes_on)
        self._entity = entity

    @property
    def id(self) -> Any:
        self._check()
        return self._session.id_of(self._entity.number)

    @property
    def key_expr(self) -> KeyExpr:
        self._check()
        return self._entity.key

    def _end(self) -> None:
        self._session.station.undeclare(self._entity)


class Queryable(Subscriber):
    real = MODULE.Queryable
    called = "queryable"


class LivelinessToken(Owned):
    real = MODULE.LivelinessToken
    called = "LivelinessToken"

    def __init__(self, session: SessionFace, entity: LocalEntity) -> None:
        super().__init__(session)
        self._entity = entity

    def _end(self) -> None:
        self._session.station.undeclare(self._entity)


class Querier(Sending):
    real = MODULE.Querier
    called = "querier"

    def __init__(self, session: SessionFace, key: KeyExpr, options: GetOptions) -> None:
        super().__init__(session, key)
        self._options = options

    @property
    def accept_replies(self) -> ReplyKeyExpr:
        self._check()
        return self._options.accept

    def get(self, handler: Any = None, *, parameters: Any = None, payload: Any = None, encoding: Any = None,
            attachment: Any = None, source_info: Any = None, cancellation_token: Any = None,
            timestamp_instrumentation: Any = None) -> Any:
        refuse_given("get", source_info=source_info, cancellation_token=cancellation_token,
                     timestamp_instrumentation=timestamp_instrumentation)
        self._check_open()
        return self._session.ask(self._key, "" if parameters is None else str(MODULE.Parameters(parameters)
                                 if isinstance(parameters, dict) else parameters), handler, self._options,
                                 payload, encoding, attachment)

    def _matches(self) -> bool:
        return self._session.station.has_queryable(self._session, self._key, self._options)
