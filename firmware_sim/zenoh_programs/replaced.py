"""Zenoh in virtual time: its functions and classes replaced for threads of blocking programs; unchanged for others.

A class is replaced by one that `isinstance` and annotations take for both, and whose construction chooses by thread.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, Final

from firmware_sim.blocking.here import this_program
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.replacing import Replacement, Replacements
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

KEY: Final = ("zenoh", "specification")        # in `program.shared`
CLASSES: Final[list[type]] = [
    session.Session, session.SessionInfo, identifiers.ZenohId, identifiers.EntityGlobalId, sample.Sample, asking.Reply,
    asking.ReplyError, answering.Query, entities.Publisher, entities.Subscriber, entities.Queryable, entities.Querier,
    entities.LivelinessToken, liveliness.Liveliness, matching.MatchingListener, matching.MatchingStatus,
    channels.Handler]
CHANNELS: Final[list[type]] = [channels.Handler, channels.DefaultHandler, channels.FifoChannel, channels.RingChannel,
                               channels.Callback]


def _open(program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
    return session.open_session(program.shared[KEY], *args, **kwargs)


def _log(program: BlockingProgram, *args: Any) -> None:
    """Do nothing: the library, whose log it is, does not run here."""


def _refused(name: str, program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
    refuse(name)


FUNCTIONS: Final[list[Replacement]] = [
    (MODULE, "open", _open),
    (MODULE, "try_init_log_from_env", _log),
    (MODULE, "init_log_from_env_or", _log),
    (MODULE, "scout", partial(_refused, "scout")),
    (MODULE, "CancellationToken", partial(_refused, "CancellationToken")),
    (EXT, "declare_advanced_publisher", partial(_refused, "ext.declare_advanced_publisher")),
    (EXT, "declare_advanced_subscriber", partial(_refused, "ext.declare_advanced_subscriber")),
]
_replacements: Final = Replacements(FUNCTIONS, classes=[
    *((MODULE, each) for each in CLASSES), *((HANDLERS, each) for each in CHANNELS)])


@contextmanager
def zenoh_in_virtual_time(specification: ZenohSpecification, *, everywhere: bool = False) -> Iterator[None]:
    """Within this context Zenoh is on the media of their nodes in threads of blocking programs, and only there.

    The sessions of the calling program are on those of `specification`; `everywhere`: see `Replacements.in_place`.
    """
    this_program().shared[KEY] = specification
    with _replacements.in_place(everywhere=everywhere):
        yield
