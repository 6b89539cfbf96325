"""Whether anybody matches a publisher or a querier, as far as this node knows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from firmware_sim.zenoh_programs.channels import Sink, open_sink
from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.faces import SessionFace
from firmware_sim.zenoh_programs.local_entity import Receiving
from firmware_sim.zenoh_programs.real import MODULE


class MatchingStatus(StandIn):
    real = MODULE.MatchingStatus

    def __init__(self, matching: bool) -> None:
        self.matching = matching

    def __repr__(self) -> str:
        return f"MatchingStatus {{ matching: {str(self.matching).lower()} }}"


class Watch:
    """Puts a status each time that it changes; the first if there is a match at the beginning."""

    def __init__(self, matches: Callable[[], bool], sink: Sink) -> None:
        self._matches = matches
        self._last = False
        self.sink = sink
        self.look()

    def look(self) -> None:
        matches = self._matches()
        if matches != self._last:
            self._last = matches
            self.sink.put(MatchingStatus(matches))


class MatchingListener(Receiving):
    real = MODULE.MatchingListener
    called = "matching listener"

    def __init__(self, session: SessionFace, matches: Callable[[], bool], given: Any) -> None:
        sink, handler, goes_on = open_sink(session.station.program, given, "MatchingStatus")
        super().__init__(session, handler=handler, goes_on=goes_on)
        self._watch = Watch(matches, sink)
        session.watches.append(self._watch)

    def _end(self) -> None:
        self._session.watches.remove(self._watch)
        self._watch.sink.close()
