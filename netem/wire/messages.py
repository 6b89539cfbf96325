"""What the conductor and a node say to each other, as MessagePack arrays.

A node's promise is a pair: `soft_ns`, before which it hands out nothing unless it hears something first, and `firm_ns`,
before which it hands out nothing whatever it hears. The earliest instant at which it can hand anything out is therefore
max(firm_ns, min(soft_ns, its first undelivered frame)).
"""

from __future__ import annotations

from typing import Final

import msgspec

from netem.wire.level import Level

UNREADABLE: Final = (msgspec.MsgspecError, UnicodeDecodeError)      # what decoding bytes of any kind can raise

Delivery = tuple[int, int, bytes]       # (arrival_ns, port index, data)
Offer = tuple[int, int, bytes]          # (time_ns, port index, data), in the order in which they were handed out
Sample = tuple[int, list[float]]        # (time_ns, one value for each declared signal)
Event = tuple[int, str, str, Level]     # (time_ns, kind, detail, level)


class Grant(msgspec.Struct, array_like=True, gc=False):
    """Run up to `horizon_ns`: exclusive, or with `instant` the events at `horizon_ns` as well."""

    window: int
    horizon_ns: int
    instant: bool
    last: bool                          # the run ends here: answer, then close
    deliveries: list[Delivery]


class Report(msgspec.Struct, array_like=True, gc=False):
    """Answer to one grant."""

    window: int
    soft_ns: int
    firm_ns: int
    offers: list[Offer]
    samples: list[Sample]
    events: list[Event]
    counters: dict[str, int]            # in the last report, in that of an error, and with processes now and then
    error: str                          # traceback of the program, "" if all is well
    ends: tuple[int, str] | None = None     # (time_ns, reason) if the node ends the run


class Hello(msgspec.Struct, array_like=True, gc=False):
    """A node is ready: its first promise, the signals that it samples and the ports that it has."""

    node: str
    soft_ns: int
    firm_ns: int
    ports: list[str]
    signals: list[tuple[str, str]]      # (name, unit)
    quiet: list[int] = []               # ports at which what arrives makes it hand out nothing by itself
    error: str = ""
