"""Counters of this package, by name: a board declares them, so that a counter of what never happened exists and is 0.

`frames lost from SYSTEM/COMPONENT` is not among them: who is heard shows only in the run.
"""

from __future__ import annotations

from typing import Final

from firmware_sim.mavlink.signing import Verdict

LINK_COUNTERS: Final = (
    "frames sent", "frames taken", "frames lost", "frames for others", "own frames heard", "incomplete frames",
    "unknown flags", "unknown messages", "bad checksums", "noise bytes",
    *(f"frames refused: {verdict.value}" for verdict in Verdict if verdict is not Verdict.TAKEN))
FRONT_COUNTERS: Final = (*LINK_COUNTERS, "frames not answered", "setpoints taken", "setpoints refused",
                         "setpoints clipped or refused", "bytes overrun")
COMPANION_COUNTERS: Final = (*LINK_COUNTERS, "positions that are not finite")
