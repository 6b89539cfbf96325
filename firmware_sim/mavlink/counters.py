"""The names of this package's counters: a board declares them, so that a counter without an event exists and is 0.

`frames lost from SYSTEM/COMPONENT` is not among them: the sources are known only during the run.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from firmware_sim.board import Board
from firmware_sim.mavlink.signing import Verdict

LINK_COUNTERS: Final = (
    "frames sent", "frames taken", "frames lost", "frames for others", "own frames heard", "incomplete frames",
    "unknown flags", "unknown messages", "bad checksums", "noise bytes",
    *(f"frames refused: {verdict.value}" for verdict in Verdict if verdict is not Verdict.TAKEN))
FRONT_COUNTERS: Final = (*LINK_COUNTERS, "frames not answered", "frames passed on", "setpoints taken",
                         "setpoints refused", "setpoints clipped or refused", "bytes overrun")
COMPANION_COUNTERS: Final = (*LINK_COUNTERS, "positions that are not finite")


class BoardCounters:
    """Counters of a board, each named "mavlink NAME", that follow the counts of a link."""

    def __init__(self, board: Board, names: Iterable[str]) -> None:
        self._board = board
        self._told: dict[str, int] = {}
        for name in names:
            board.count(f"mavlink {name}", 0)

    def note(self, counts: Mapping[str, int]) -> None:
        """Add what `counts` have gained since the last call."""
        told = self._told
        for name, count in counts.items():
            more = count - told.get(name, 0)
            if more:
                self._board.count(f"mavlink {name}", more)
                told[name] = count
