"""Messages between the conductor and a node, encoded as MessagePack arrays.

A node's promise is a pair of instants in ns. Before `soft_ns` the node makes no offer unless a frame is delivered to it
first; before `firm_ns` it makes none whatever is delivered. Its next offer therefore comes no earlier than
max(firm_ns, min(soft_ns, arrival of its first undelivered frame)).
"""

from __future__ import annotations

from typing import Any, Final

import msgspec

from netem.wire.level import Level

UNREADABLE: Final = (msgspec.MsgspecError, UnicodeDecodeError)      # what decoding bytes of any kind can raise

Delivery = tuple[int, int, bytes]       # (arrival_ns, port index, data)
Offer = tuple[int, int, bytes]          # (time_ns, port index, data)
Sample = tuple[int, list[float]]        # (time_ns, one value for each declared signal)
Shown = tuple[int, int, list[float]]    # (time_ns, port index, outputs of the node's plant that the medium reads)
Event = tuple[int, str, str, Level]     # (time_ns, kind, detail, level)


class NodeFault(msgspec.Struct, array_like=True, frozen=True):
    """A fault within a node at `time_ns`: it acts after all events before that instant and before those at it."""

    time_ns: int
    kind: str
    fields: dict[str, Any]


class Grant(msgspec.Struct, array_like=True, gc=False):
    """Lets a node run its events before `horizon_ns`, and with `instant` those at `horizon_ns` as well."""

    window: int
    horizon_ns: int
    instant: bool
    last: bool                          # the run ends at the horizon: the node answers, then closes
    deliveries: list[Delivery]
    faults: list[NodeFault] = []        # in order of time, none before the last horizon, none after this one


class Report(msgspec.Struct, array_like=True, gc=False):
    """A node's answer to one grant; `offers` are in the order in which its program sent the frames."""

    window: int
    soft_ns: int
    firm_ns: int
    offers: list[Offer]
    samples: list[Sample]
    events: list[Event]
    counters: dict[str, int]            # filled in the last report, in one with an error, and at times by a process
    error: str                          # traceback of the program, "" if all is well
    ends: tuple[int, str] | None = None     # (time_ns, reason) if the node ends the run
    state: bytes | None = None          # what outlives a node that is killed: the state of its plant and its clock
    shown: list[Shown] = []


class Hello(msgspec.Struct, array_like=True, gc=False):
    """Tells the conductor that a node is ready: its first promise, its ports, and the signals that it samples."""

    node: str
    soft_ns: int
    firm_ns: int
    ports: list[str]
    signals: list[tuple[str, str]]      # (name, unit)
    quiet: list[int] = []               # indices of ports whose deliveries cause no offer by themselves
    error: str = ""                     # traceback of a program that could not start


class Life(msgspec.Struct, array_like=True):
    """The next life of a node that was killed: without a program until `boots_ns`, when its program starts anew."""

    number: int                         # 1 for the first life after the first kill
    from_ns: int                        # instant of the kill
    boots_ns: int                       # NEVER_NS: no program any more
    state: bytes                        # from the last report of the life before
    signals: list[tuple[str, str]]      # (name, unit) of the first life; nan while nothing reads them
    quiet: list[int]                    # ports whose deliveries cause no offer by themselves, as in the first life
    fields: dict[str, Any]              # of the fault
