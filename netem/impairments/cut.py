"""A link that faults cut: copies are lost that enter it, or would arrive, within windows that the fault adds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.core.windows import Windows
from netem.impairments import Impairment


class Entrance(Impairment):
    """First on the link: loses copies that enter it within the windows."""

    loses_as: ClassVar = Fate.CUT

    def __init__(self, windows: Windows) -> None:
        self._windows = windows

    def carry(self, transit: Transit) -> Iterable[Transit]:
        return () if self._windows.hold(transit.sent_ns) else (transit,)


class Exit(Impairment):
    """Last on the link: loses copies that would arrive within the windows."""

    loses_as: ClassVar = Fate.CUT

    def __init__(self, windows: Windows) -> None:
        self._windows = windows

    def carry(self, transit: Transit) -> Iterable[Transit]:
        return () if self._windows.hold(transit.arrival_ns) else (transit,)
