"""The liveliness of a session: tokens of its own, and what it knows of those of all nodes.

`get` answers from what this node has heard, as the library does between peers; it sends nothing and never times out.
"""

from __future__ import annotations

from typing import Any

from firmware_sim.zenoh_programs.asking import Reply
from firmware_sim.zenoh_programs.channels import open_sink
from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.entities import LivelinessToken, Subscriber
from firmware_sim.zenoh_programs.faces import SessionFace
from firmware_sim.zenoh_programs.local_entity import LocalEntity
from firmware_sim.zenoh_programs.outside_subset import refuse_given
from firmware_sim.zenoh_programs.real import MODULE
from firmware_sim.zenoh_programs.tokens import Listener
from firmware_sim.zenoh_programs.values import key_of
from netem.wire.zenoh_messages import Entity


class Liveliness(StandIn):
    real = MODULE.Liveliness

    def __init__(self, session: SessionFace) -> None:
        self._session = session

    def declare_token(self, key_expr: Any) -> LivelinessToken:
        session, key = self._session, key_of(key_expr)
        session.check_open()
        entity = LocalEntity(session, Entity.TOKEN, session.station.next_number(), key)
        session.station.declare(entity)
        return LivelinessToken(session, entity)

    def declare_subscriber(self, key_expr: Any, handler: Any = None, *, history: bool | None = None) -> Subscriber:
        session, key = self._session, key_of(key_expr)
        session.check_open()
        station = session.station
        sink, given, goes_on = open_sink(station.program, handler, "Sample")
        listener = Listener(key, sink)
        if history:
            for sample in station.tokens.alive(key):
                sink.put(sample)
        station.tokens.listeners.append(listener)
        session.listeners.append(listener)
        entity = LocalEntity(session, Entity.SUBSCRIBER, station.next_number(), key)
        return _LivelinessSubscriber(session, entity, given, goes_on=goes_on, listener=listener)

    def get(self, key_expr: Any, handler: Any = None, *, timeout: float | None = None,
            cancellation_token: Any = None) -> Any:
        refuse_given("liveliness get", cancellation_token=cancellation_token)
        session, key = self._session, key_of(key_expr)
        session.check_open()
        sink, given, _ = open_sink(session.station.program, handler, "Reply")
        for sample in session.station.tokens.alive(key):
            sink.put(Reply(sample, None))
        sink.close()
        return given


class _LivelinessSubscriber(Subscriber):
    """A subscriber of which other nodes are not told."""

    def __init__(self, session: SessionFace, entity: LocalEntity, handler: Any, *, goes_on: bool,
                 listener: Listener) -> None:
        super().__init__(session, entity, handler, goes_on=goes_on)
        self._listener = listener

    def _end(self) -> None:
        self._session.forget(self._listener)
