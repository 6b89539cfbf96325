"""Zenoh in virtual time: its functions and classes replaced for threads of blocking programs; unchanged for others.

A function chooses by the thread that calls it. A class is replaced by one that `isinstance` and annotations take for
both, and whose construction chooses by thread. The library's own are put back at the end of the last program.

Differs from the house rule against module-level state: Python has one module `zenoh` for each process.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial, wraps
from typing import Any

from firmware_sim.blocking.here import running, this_program
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.zenoh_programs import (
    answering,
    asking,
    channels,
    entities,
    identifiers,
    liveliness,
    matching,
    sample,
    session,
)
from firmware_sim.zenoh_programs.outside_subset import refuse
from firmware_sim.zenoh_programs.real import EXT, HANDLERS, MODULE
from firmware_sim.zenoh_programs.specification import ZenohSpecification

KEY = ("zenoh", "specification")        # in `program.shared`
CLASSES: list[type] = [
    session.Session, session.SessionInfo, identifiers.ZenohId, identifiers.EntityGlobalId, sample.Sample, asking.Reply,
    asking.ReplyError, answering.Query, entities.Publisher, entities.Subscriber, entities.Queryable, entities.Querier,
    entities.LivelinessToken, liveliness.Liveliness, matching.MatchingListener, matching.MatchingStatus,
    channels.Handler]
CHANNELS: list[type] = [channels.Handler, channels.DefaultHandler, channels.FifoChannel, channels.RingChannel,
                        channels.Callback]


def _open(program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
    return session.open_session(program.shared[KEY], *args, **kwargs)


def _log(program: BlockingProgram, *args: Any) -> None:
    """Do nothing: the library, whose log it is, does not run here."""


def _refused(name: str, program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
    refuse(name)


FUNCTIONS: list[tuple[Any, str, Callable[..., Any]]] = [
    (MODULE, "open", _open),
    (MODULE, "try_init_log_from_env", _log),
    (MODULE, "init_log_from_env_or", _log),
    (MODULE, "scout", partial(_refused, "scout")),
    (MODULE, "CancellationToken", partial(_refused, "CancellationToken")),
    (EXT, "declare_advanced_publisher", partial(_refused, "ext.declare_advanced_publisher")),
    (EXT, "declare_advanced_subscriber", partial(_refused, "ext.declare_advanced_subscriber")),
]
_before: list[tuple[Any, str, Any]] = []
_users: list[object] = []


@contextmanager
def zenoh_in_virtual_time(specification: ZenohSpecification) -> Iterator[None]:
    """Within this context Zenoh is on the media of their nodes in threads of blocking programs, and only there.

    The sessions of the calling program are on those of `specification`.
    """
    this_program().shared[KEY] = specification
    me = object()
    if not _users:
        _replace()
    _users.append(me)
    try:
        yield
    finally:
        _users.remove(me)
        if not _users:
            for place, name, real in _before:
                setattr(place, name, real)
            _before.clear()


def _replace() -> None:
    new: list[tuple[Any, str, Any]] = [(place, name, _by_thread(virtual, getattr(place, name)))
                                       for place, name, virtual in FUNCTIONS]
    new += [(MODULE, each.__name__, each) for each in CLASSES]
    new += [(HANDLERS, each.__name__, each) for each in CHANNELS]
    for place, name, ours in new:
        _before.append((place, name, getattr(place, name)))
        setattr(place, name, ours)


def _by_thread(virtual: Callable[..., Any], real: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(real)
    def either(*args: Any, **kwargs: Any) -> Any:
        program = running()
        return real(*args, **kwargs) if program is None else virtual(program, *args, **kwargs)

    return either
