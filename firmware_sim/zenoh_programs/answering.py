"""A query at the queryables that answer it; the last of them that drops it sends the final."""

from __future__ import annotations

from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from firmware_sim.blocking.here import running
from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.faces import StationFace
from firmware_sim.zenoh_programs.local_entity import LocalEntity
from firmware_sim.zenoh_programs.real import (
    MODULE,
    Encoding,
    KeyExpr,
    Parameters,
    ReplyKeyExpr,
    Selector,
    ZBytes,
    ZError,
)
from firmware_sim.zenoh_programs.values import attachment_of, encoding_of, key_of, payload_of, stamp_of
from netem.wire.zenoh_messages import Data, Request, Response, ResponseFinal

ANY_KEY = "_anyke"              # parameter of a query that takes replies for other keys


class Answering:
    """One query at one node; `send` takes each response and the final."""

    def __init__(self, station: StationFace, request: Request, key: KeyExpr,
                 send: Callable[[Response | ResponseFinal], None]) -> None:
        self.station = station
        self.request = request
        self.key = key
        self.send = send
        self.open = 0               # queries that are not dropped yet

    def close_one(self) -> None:
        self.open -= 1
        if not self.open:
            self.send(ResponseFinal(self.request.number, self.request.qos))


class Query(StandIn):
    """A query as one queryable has it."""

    real = MODULE.Query
    source_info = None
    timestamp_stack = None

    def __init__(self, answering: Answering, queryable: LocalEntity) -> None:
        self._answering: Answering | None = answering
        self.queryable = queryable
        answering.open += 1

    @property
    def selector(self) -> Selector:
        return Selector(self.key_expr, self.parameters)

    @property
    def key_expr(self) -> KeyExpr:
        return self._held().key

    @property
    def parameters(self) -> Parameters:
        return Parameters(self._held().request.parameters)

    @property
    def payload(self) -> ZBytes | None:
        payload = self._held().request.payload
        return None if payload is None else ZBytes(payload)

    @property
    def encoding(self) -> Encoding | None:
        request = self._held().request
        return None if request.payload is None else Encoding(request.encoding)

    @property
    def attachment(self) -> ZBytes | None:
        attachment = self._held().request.attachment
        return None if attachment is None else ZBytes(attachment)

    def accepts_replies(self) -> ReplyKeyExpr:
        return ReplyKeyExpr.ANY if _takes_any(self._held().request) else ReplyKeyExpr.MATCHING_QUERY

    def reply(self, key_expr: Any, payload: Any, *, encoding: Any = None, congestion_control: Any = None,
              priority: Any = None, express: Any = None, attachment: Any = None, timestamp: Any = None) -> None:
        """Reply; as in the library, priority, congestion control and express are those of the query."""
        held = self._held()
        self._send(held, key_expr, Data(payload_of(payload), str(encoding_of(encoding, Encoding.ZENOH_BYTES)),
                                        attachment_of(attachment), stamp_of(timestamp)))

    def reply_del(self, key_expr: Any, *, congestion_control: Any = None, priority: Any = None, express: Any = None,
                  attachment: Any = None, timestamp: Any = None) -> None:
        held = self._held()
        self._send(held, key_expr, Data(attachment=attachment_of(attachment), stamp=stamp_of(timestamp), deletes=True))

    def reply_err(self, payload: Any, *, encoding: Any = None) -> None:
        held = self._held()
        data = Data(payload_of(payload), str(encoding_of(encoding, Encoding.ZENOH_BYTES)))
        held.send(self._response(held, str(held.key), data, error=True))

    def drop(self) -> None:
        held, self._answering = self._answering, None
        if held is not None:
            held.close_one()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 where: TracebackType | None) -> None:
        self.drop()

    def __del__(self) -> None:
        held = getattr(self, "_answering", None)
        if held is not None and running() is held.station.program and not held.station.ends:
            self.drop()

    def __str__(self) -> str:
        held = self._held()
        return f'Query {{ selector: "{held.key}{held.request.parameters}" }}'

    def __repr__(self) -> str:
        held = self._held()
        return f"Query {{ key_selector: {held.key!r}, parameters: {held.request.parameters} }}"

    def _held(self) -> Answering:
        if self._answering is None:
            raise ZError("Dropped query")
        return self._answering

    def _send(self, held: Answering, key_expr: Any, data: Data) -> None:
        key = key_of(key_expr)
        if not _takes_any(held.request) and not key.intersects(held.key):
            raise ZError(f"Attempted to reply on `{key}`, which does not intersect with query `{held.key}`, despite "
                         "query only allowing replies on matching key expressions")
        held.send(self._response(held, str(key), data))

    def _response(self, held: Answering, key: str, data: Data, *, error: bool = False) -> Response:
        return Response(held.request.number, key, data, held.station.identifier, self.queryable.number, error,
                        held.request.qos)


def _takes_any(request: Request) -> bool:
    return any(part.partition("=")[0] == ANY_KEY for part in request.parameters.split(";"))
