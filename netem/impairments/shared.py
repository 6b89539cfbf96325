"""One state for all links of a selection: a jammer that all hear, one modem or queue through which all must go.

A frame passes a shared impairment once, with the first of its copies, however many of the links it takes: all its
copies end alike. What happened to the first copy, lost, later by so much, changed or doubled, happens to the others.
Frames pass in the order in which the medium received them, and are numbered so, from 0 (`scripted_loss`, `trace`).

The random stream is named by the seed and the impairment's name or place, not by a link. A further link changes the
draws of the others only in so far as frames pass that did not pass before; the state of `gilbert_elliott_by_time`
depends on the time alone.

Not modelled: a copy that another impairment changed before reaches this one as a frame of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.core.transit import Transit
from netem.impairments import Impairment

Change = tuple[int, Transit]            # (delay_ns, copy) of each that comes out


class Shared:
    """Wraps the impairment that all links of a selection share."""

    def __init__(self, impairment: Impairment) -> None:
        self.impairment = impairment
        self.loses_as: Fate = impairment.loses_as
        self._frame: Frame | None = None
        self._number = -1
        self._passed: dict[tuple[int, bytes, bool, bool], list[Change]] = {}      # of that frame, by what a copy is

    def carry(self, transit: Transit) -> Iterable[Transit]:
        if transit.frame is not self._frame or transit.frame is None:
            self._frame = transit.frame
            self._number += 1
            self._passed.clear()
        key = (transit.copy, transit.data, transit.corrupt, transit.undetected)
        changes = self._passed.get(key)
        if changes is None:
            came_ns = transit.arrival_ns
            changes = self._passed[key] = [(out.arrival_ns - came_ns, out)
                                           for out in self.impairment.carry(replace(transit, number=self._number))]
        return self._leave(transit, changes)

    def _leave(self, transit: Transit, changes: list[Change]) -> Iterator[Transit]:
        for delay_ns, out in changes:
            yield replace(out, number=transit.number, sent_ns=transit.sent_ns, copy=transit.copy,
                          arrival_ns=transit.arrival_ns + delay_ns)
