"""An impairment that acts within the windows of a fault, to which windows may be added during the run."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from netem.core.transit import Transit
from netem.core.windows import Windows
from netem.impairments import Impairment


class Within(Impairment):
    """With `now_ns`, the clock of the emulator, it spares copies that their medium passed on before the window began.
    """

    def __init__(self, impairment: Impairment, windows: Windows, now_ns: Callable[[], int] | None = None) -> None:
        self.loses_as = impairment.loses_as     # type: ignore[misc]    # that of a class, there
        self._impairment, self._windows, self._now_ns = impairment, windows, now_ns

    def carry(self, transit: Transit) -> Iterable[Transit]:
        passed_ns = transit.sent_ns if self._now_ns is None else self._now_ns()
        return self._impairment.carry(transit) if self._windows.hold_both(passed_ns, transit.sent_ns) else (transit,)
