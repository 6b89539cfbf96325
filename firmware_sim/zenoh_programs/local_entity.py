"""An entity that a session of this node has declared, and the base of the objects by which a program holds one.

    Publisher, Subscriber, Queryable, Querier, LivelinessToken, MatchingListener --> Owned

As in the library an object that was undeclared raises ZError on every use; one that nobody holds any more is
undeclared, unless it calls a callback.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from firmware_sim.blocking.here import running
from firmware_sim.zenoh_programs.channels import Handler, Sink
from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.faces import SessionFace
from firmware_sim.zenoh_programs.real import KeyExpr, Locality, ZError
from netem.wire.zenoh_messages import Declare, Entity, Undeclare


@dataclass(eq=False)
class LocalEntity:
    session: SessionFace
    entity: Entity
    number: int
    key: KeyExpr
    origin: Locality | None = None      # whose messages it takes, None: everybody's
    complete: bool = False
    sink: Sink | None = None

    @property
    def declaration(self) -> Declare:
        return Declare(self.entity, self.number, str(self.key), self.complete)

    @property
    def undeclaration(self) -> Undeclare:
        return Undeclare(self.entity, self.number)

    def takes_from(self, session: SessionFace | None) -> bool:
        """Return whether its `allowed_origin` allows messages of `session`, None: of another node."""
        if self.origin is None or self.origin == Locality.ANY:
            return True
        return (self.origin == Locality.SESSION_LOCAL) == (session is self.session)


class Owned(StandIn):
    """An object of the program that ends with `undeclare`, with its `with` block, or with nobody holding it."""

    called = ""                         # in messages

    def __init__(self, session: SessionFace, *, handler: Any = None, goes_on: bool = False) -> None:
        self._session = session
        self._handler = handler
        self._goes_on = goes_on         # True: a callback keeps it declared
        self._declared = True

    def undeclare(self) -> None:
        self._check()
        self._declared = False
        if not self._session.closed:
            self._end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 where: TracebackType | None) -> None:
        if self._declared:
            self.undeclare()

    def __del__(self) -> None:
        session = getattr(self, "_session", None)
        if session is None or self._goes_on or not self._declared or session.closed:
            return
        if running() is session.station.program and not session.station.ends:
            self.undeclare()

    def _check(self) -> None:
        if not self._declared:
            raise ZError(f"Undeclared {self.called}")

    def _check_open(self) -> None:
        self._check()
        self._session.check_open()

    def _end(self) -> None:
        raise NotImplementedError


class Receiving(Owned):
    """An object with a handler."""

    @property
    def handler(self) -> Any:
        self._check()
        return self._handler

    def recv(self) -> Any:
        return self._channel().recv()

    def try_recv(self) -> Any:
        return self._channel().try_recv()

    def __iter__(self) -> Any:
        return iter(self._channel())

    def _channel(self) -> Any:
        self._check()
        if not isinstance(self._handler, Handler) and not hasattr(self._handler, "recv"):
            raise AttributeError(f"'{type(self._handler).__name__}' object has no attribute 'recv'")
        return self._handler
