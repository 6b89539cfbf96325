"""What entities and queries use of their session and station, so that their modules do not import these."""

from __future__ import annotations

from typing import Any, Protocol

from firmware_sim.blocking.program import BlockingProgram


class StationFace(Protocol):
    """The part of `station.Station`."""

    program: BlockingProgram
    identifier: bytes
    tokens: Any

    @property
    def ends(self) -> bool: ...

    def next_number(self) -> int: ...

    def declare(self, entity: Any) -> None: ...

    def undeclare(self, entity: Any) -> None: ...

    def has_subscriber(self, session: Any, key: Any, destination: Any) -> bool: ...

    def has_queryable(self, session: Any, key: Any, options: Any) -> bool: ...


class SessionFace(Protocol):
    """The part of `session.Session`."""

    closed: bool
    entities: list[Any]
    watches: list[Any]
    listeners: list[Any]

    @property
    def station(self) -> StationFace: ...

    def check_open(self) -> None: ...

    def id_of(self, number: int) -> Any: ...

    def next_id(self) -> Any: ...

    def push(self, key: Any, data: Any, qos: Any, destination: Any) -> None: ...

    def ask(self, key: Any, parameters: str, handler: Any, options: Any, payload: Any, encoding: Any,
            attachment: Any) -> Any: ...

    def forget(self, listener: Any) -> None: ...
