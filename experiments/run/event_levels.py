"""Which events of nodes and media are warnings: something that a run takes for granted, or that nobody wants, broke.

The rest tells how a run went. Guarantees give their own level (`monitors/judge.py`).
"""

from __future__ import annotations

from typing import Final

from netem.records.events import Level

WARNINGS: Final = frozenset({
    "assumption violated", "refused measurement",                                   # agents/tracking
    "fell back", "incomplete discovery",                                            # agents/synchronization
    "setpoint stale", "setpoint refused",                                           # firmware_sim/drive_controller
    "autopilot critical", "autopilot error", "autopilot warning",                   # firmware_sim/autopilot
    "nothing in view", "order failed", "detection refused",                         # agents/pursuit
    "error-passive", "bus-off", "no acknowledgement", "same identifier", "malformed CAN frame",     # netem/media/can
    "message may be late", "not as declared",
    "overrun", "gateway peer refused",                                              # netem/gateways
})


def level_of(kind: str) -> Level:
    return Level.WARNING if kind in WARNINGS else Level.INFO
