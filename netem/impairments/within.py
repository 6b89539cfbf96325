"""An impairment that acts within the windows of a fault, to which windows may be added during the run."""

from __future__ import annotations

from collections.abc import Iterable

from netem.core.transit import Transit
from netem.core.windows import Windows
from netem.impairments import Impairment


class Within(Impairment):
    def __init__(self, impairment: Impairment, windows: Windows) -> None:
        self.loses_as = impairment.loses_as     # type: ignore[misc]    # that of a class, there
        self._impairment, self._windows = impairment, windows

    def carry(self, transit: Transit) -> Iterable[Transit]:
        return self._impairment.carry(transit) if self._windows.hold(transit.sent_ns) else (transit,)
