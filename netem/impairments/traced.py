"""Notes what impairments did to the copies of a run, so that a scenario can repeat it by scripts.

    impairment --watch--> Traced --carry--> Effect: number and copy on the link, what came out

Only what changes a copy is noted, of impairments that `written_out` says can be written out copy by copy.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import msgspec

from netem.core.fate import Fate
from netem.core.link_name import LinkName
from netem.core.transit import Transit
from netem.impairments import Impairment


class Out(msgspec.Struct, frozen=True, array_like=True):
    """One copy that left. `bits` are those that were flipped here."""

    delay_ns: int
    bits: tuple[int, ...] = ()
    undetected: bool = False


class Effect(msgspec.Struct, frozen=True, array_like=True):
    """What came `out` for the copy `copy` of frame `number` of a link, which entered the link at `sent_ns`."""

    number: int
    copy: int
    sent_ns: int
    out: tuple[Out, ...]


class Watched(msgspec.Struct, array_like=True):
    """One impairment on one link; `copies` is the largest number of a copy that entered it."""

    cause: str
    link: LinkName
    effects: list[Effect] = []
    copies: int = 0


class Trace:
    """The impairments of a run that are watched. `cause` names an impairment or a fault, as in the ledger."""

    def __init__(self) -> None:
        self.watched: list[Watched] = []

    def watch(self, cause: str, link: LinkName, impairment: Any) -> Impairment:
        """Return what stands on the link in place of the impairment."""
        watched = Watched(cause, link)
        self.watched.append(watched)
        return Traced(impairment, watched)


class Traced(Impairment):
    def __init__(self, impairment: Any, watched: Watched) -> None:
        self.loses_as: Fate = impairment.loses_as       # type: ignore[misc]    # that of a class, there
        self._impairment, self._watched = impairment, watched

    def carry(self, transit: Transit) -> Iterable[Transit]:
        found = list(self._impairment.carry(transit))
        watched = self._watched
        watched.copies = max(watched.copies, transit.copy)
        if len(found) != 1 or _changed(transit, found[0]):
            watched.effects.append(Effect(transit.number, transit.copy, transit.sent_ns,
                                          tuple(_out(transit, out) for out in found)))
        return found


def _changed(came: Transit, out: Transit) -> bool:
    return out is not came and (out.arrival_ns != came.arrival_ns or out.data != came.data)


def _out(came: Transit, out: Transit) -> Out:
    delay_ns = out.arrival_ns - came.arrival_ns
    if out.data == came.data:
        return Out(delay_ns)
    differing = int.from_bytes(came.data, "big") ^ int.from_bytes(out.data, "big")
    bits = 8 * len(came.data)
    return Out(delay_ns, tuple(bits - place - 1 for place in range(bits - 1, -1, -1) if differing >> place & 1),
               out.undetected)
