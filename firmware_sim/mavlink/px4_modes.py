"""PX4's numbers for the modes of the vehicle: custom_mode = main << 16 | sub << 24.

Source: PX4's px4_custom_mode.h, as MAVSDK, QGroundControl and MAVProxy read it. PX4's manual modes (MANUAL, ALTCTL,
POSCTL, ACRO) are not supported, since this vehicle has no remote control.
"""

from __future__ import annotations

from typing import Final

from firmware_sim.autopilot.vehicle import Mode
from firmware_sim.mavlink.enums import ModeFlag

AUTO: Final = 4
MAIN_AND_SUB: Final = {
    Mode.STABILIZE: (7, 0),
    Mode.OFFBOARD: (6, 0),
    Mode.TAKEOFF: (AUTO, 2),
    Mode.HOLD: (AUTO, 3),
    Mode.MISSION: (AUTO, 4),
    Mode.RETURN: (AUTO, 5),
    Mode.LAND: (AUTO, 6),
}
MODE_OF: Final = {numbers: mode for mode, numbers in MAIN_AND_SUB.items()}


def custom_mode(mode: Mode) -> int:
    main, sub = MAIN_AND_SUB[mode]
    return main << 16 | sub << 24


def mode_of_custom(custom: int) -> Mode | None:
    """Return the mode of a custom_mode; None if the vehicle does not have it."""
    return MODE_OF.get((custom >> 16 & 0xFF, custom >> 24 & 0xFF)) if custom & 0xFFFF == 0 else None


def base_mode(mode: Mode, armed: bool) -> ModeFlag:
    flags = ModeFlag.CUSTOM_MODE_ENABLED | ModeFlag.STABILIZE_ENABLED
    if MAIN_AND_SUB[mode][0] == AUTO:
        flags |= ModeFlag.AUTO_ENABLED | ModeFlag.GUIDED_ENABLED
    elif mode is Mode.OFFBOARD:
        flags |= ModeFlag.GUIDED_ENABLED
    return flags | ModeFlag.SAFETY_ARMED if armed else flags
