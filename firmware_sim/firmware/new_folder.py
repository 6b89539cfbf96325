"""Writes a new folder with a firmware that runs: the beacon under another name, and a scenario of two robots."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from firmware_sim.firmware.build import FIRMWARE
from firmware_sim.firmware.errors import FirmwareError

PATTERN: Final = "beacon"
SCENARIO: Final = "two_robots.toml"
_SCENARIO_TEXT: Final = """# Two robots with this firmware.
# Question: does each hear the frames of the other?
seed = 1
length_s = 1.0

[agents_defaults]
firmware = "."

[agents.a]

[agents.b]
parameters = { period_ms = 70 }

[media.radio]
kind = "broadcast_radio"
preset = "ideal"
topology = { kind = "fixed", links = ["* -> *"] }

[expect]
"count.*.frames heard" = { min = 10 }
"""


def write_new(folder: Path) -> list[Path]:
    """Write the files of a new firmware, called as its folder; return their paths.

    Raises FirmwareError if the folder has files already or its name cannot be that of a firmware.
    """
    name = folder.absolute().name
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise FirmwareError(f"{folder}: expected a name of small letters, digits and _, as the firmware gets it")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise FirmwareError(f"{folder}: is there already: give a new or an empty folder")
    pattern = FIRMWARE / PATTERN
    table = (pattern / "firmware.toml").read_text().replace(f'name = "{PATTERN}"', f'name = "{name}"')
    code = (pattern / f"{PATTERN}.c").read_text().replace(f"{PATTERN}.c", f"{name}.c")
    folder.mkdir(parents=True, exist_ok=True)
    written = {folder / "firmware.toml": table, folder / f"{name}.c": code, folder / SCENARIO: _SCENARIO_TEXT}
    for path, text in written.items():
        path.write_text(text)
    return list(written)
