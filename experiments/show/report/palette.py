"""The colours of report and picture, each once for light pages and once for dark ones.

Every colour stands out from the card behind it by a contrast of at least 3 : 1, which WCAG 2.1 (1.4.11) asks of
graphics. Curves take their hues from Okabe and Ito (2008), darkened or lightened, so that colour-blind readers tell
them apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from netem.core.fate import Fate


class Pair(NamedTuple):
    light: str
    dark: str


CARD: Final = Pair("#ffffff", "#1d2125")        # as --card in report.css and the background of the picture
CURVES: Final = (Pair("#0072b2", "#7f95ff"), Pair("#b97d00", "#e69f00"), Pair("#008a63", "#14c494"),
                 Pair("#d55e00", "#ff7a2f"), Pair("#b4568c", "#e08fbd"), Pair("#2b8fce", "#56c0f0"),
                 Pair("#767676", "#a3a3a3"))
VIOLATED: Final = Pair("#d55e00", "#ff7a2f")
SWITCHED: Final = Pair("#c22fb2", "#f070e2")
# Of modes: apart for readers with protanopia, deuteranopia and tritanopia too (`test_report_palette`).
MODES: Final = (Pair("#d55e00", "#ff7a2f"), Pair("#5b2a86", "#d3b8ff"), Pair("#008a63", "#14c494"),
                Pair("#8f8f8f", "#8d8d8d"), Pair("#0072b2", "#4f8dff"), Pair("#2b2b2b", "#f2f2f2"),
                Pair("#663300", "#aa6644"), Pair("#aa00ee", "#aaff00"))
MARKS: Final = (Pair("#b97d00", "#e6b800"), Pair("#c22fb2", "#f070e2"), Pair("#2b8fce", "#56c0f0"),
                Pair("#5c6672", "#93a0ad"))       # of events in the plane
LOW: Final = Pair("#6f95c4", "#4f7cc0")            # LOW to HIGH: a scale from few to many
MIDDLE: Final = Pair("#3a6ea5", "#5fb6a8")
HIGH: Final = Pair("#00204c", "#f5e663")
FATES: Final[Mapping[Fate, Pair]] = MappingProxyType({
    Fate.DELIVERED: Pair("#008a63", "#14c494"),
    Fate.DELIVERED_CORRUPT: Pair("#8a7d00", "#f0e442"),
    Fate.COLLIDED: Pair("#d55e00", "#ff7a2f"),
    Fate.DEAF: Pair("#b4568c", "#e08fbd"),
    Fate.TOO_WEAK: Pair("#767676", "#a3a3a3"),
    Fate.OUT_OF_VIEW: Pair("#7a8794", "#8b97a3"),
    Fate.OCCLUDED: Pair("#4d4d4d", "#c9c9c9"),
    Fate.LOST: Pair("#b97d00", "#e69f00"),
    Fate.CORRUPTED: Pair("#8f6a00", "#cfa544"),
    Fate.QUEUE_FULL: Pair("#0072b2", "#7f95ff"),
    Fate.BUS_OFF: Pair("#3b3b98", "#8f8fe8"),
    Fate.ARBITRATION_LOST: Pair("#5a6b1f", "#a9bf5a"),
    Fate.SENDER_BUSY: Pair("#2b8fce", "#56c0f0"),
    Fate.CHANNEL_BUSY: Pair("#7b68c8", "#a596ec"),
    Fate.MALFORMED: Pair("#a05a2c", "#cf8657"),
    Fate.UNFINISHED: Pair("#87929d", "#b9c2cb"),
    Fate.RECEIVER_GONE: Pair("#5c6672", "#93a0ad"),
    Fate.RECEIVER_PAUSED: Pair("#4a7a8c", "#7fb3c8"),
    Fate.CUT: Pair("#a4243b", "#f2708a"),
    Fate.JAMMED: Pair("#7a1fa2", "#c77dff"),
    Fate.BLACKED_OUT: Pair("#1f4e4a", "#5fa8a0"),
})


def for_page() -> dict[str, object]:
    """Return the palette for the page's script; the keys of fates are their values in the ledger."""
    return {"curves": CURVES, "violated": VIOLATED, "switched": SWITCHED, "low": LOW, "middle": MIDDLE,
            "high": HIGH, "modes": MODES, "marks": MARKS, "fates": {fate.value: pair for fate, pair in FATES.items()}}
