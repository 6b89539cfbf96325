"""A link that faults cut: copies are lost that enter it, or would arrive, within windows that the fault adds."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import ClassVar

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.core.windows import Windows
from netem.impairments import Impairment


class Entrance(Impairment):
    """First on the link: loses copies that enter it within the windows.

    A medium may pass a copy to its link before the copy enters, by a receive latency for instance. With `now_ns`, the
    clock of the emulator, a copy that was passed on before the window began is spared.
    """

    loses_as: ClassVar = Fate.CUT

    def __init__(self, windows: Windows, now_ns: Callable[[], int] | None = None) -> None:
        self._windows, self._now_ns = windows, now_ns

    def carry(self, transit: Transit) -> Iterable[Transit]:
        passed_ns = transit.sent_ns if self._now_ns is None else self._now_ns()
        return () if self._windows.hold_both(passed_ns, transit.sent_ns) else (transit,)


class Exit(Impairment):
    """Last on the link: loses copies that would arrive within the windows."""

    loses_as: ClassVar = Fate.CUT

    def __init__(self, windows: Windows) -> None:
        self._windows = windows

    def carry(self, transit: Transit) -> Iterable[Transit]:
        return () if self._windows.hold(transit.arrival_ns) else (transit,)
