"""The key `firmware` of an agent, in place of `program`: a folder of firmware in C becomes a program's class.

Within marconet such an agent's program is "firmware:TARGET:FIRMWARE", which `class_for` turns into the class.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from experiments.scenario.problems import near
from firmware_sim.firmware.build import firmware_folder
from firmware_sim.firmware.description import TABLE, read_description
from firmware_sim.firmware.errors import FirmwareError

PREFIX: Final = "firmware:"
TARGETS: Final = ("host", "cortex_m4")
NOT_BUILT_IN: Final = ("cortex_m4",)


def program_of(firmware: str, target: str) -> str:
    return f"{PREFIX}{target}:{firmware}"


def is_firmware(program: str) -> bool:
    return program.startswith(PREFIX)


def target_complaint(target: str) -> str:
    """Return why no firmware runs on `target`, "" if one does."""
    if target not in TARGETS:
        return f"no such target; {near(target, TARGETS)}"
    if target in NOT_BUILT_IN:
        return 'this target is not built in yet: expected "host"'
    return ""


def firmware_class_for(program: str, folder: Path) -> Any:
    """Return the class of the program "firmware:TARGET:FIRMWARE"; `folder` is that of the scenario.

    Raises FirmwareError for a wrong folder or firmware.toml, or a companion that cannot be imported.
    """
    _, _, firmware = program.removeprefix(PREFIX).partition(":")
    home = firmware_folder(firmware, folder).resolve()
    return _made(home, (home / TABLE).read_bytes())


@lru_cache(maxsize=64)
def _made(folder: Path, table: bytes) -> Any:
    """`table`: the content of firmware.toml, so that a changed one makes another class."""
    from experiments.scenario.program import import_program
    from firmware_sim.firmware.program import firmware_class

    firmware, companion = read_description(folder), None
    if firmware.companion:
        try:
            companion = import_program(firmware.companion, folder)
        except Exception as error:
            raise FirmwareError(f"{folder / TABLE}: companion={firmware.companion!r}: {error}") from error
    if firmware.configuration and not hasattr(companion, "configure"):
        raise FirmwareError(f"{folder / TABLE}: [[configuration]]: expected a `companion` with a static method "
                            "configure(team, name, settings), which computes these values")
    return firmware_class(firmware, folder, companion)
