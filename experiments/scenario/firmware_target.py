"""Which targets a firmware can run on: what is wrong with the keys `target`, `clock_hz`, `cycles_per_instruction`."""

from __future__ import annotations

from typing import Final

from experiments.programs.firmware_programs import ELF, Target
from experiments.scenario.problems import near

TARGETS: Final = ("host", "cortex_m4")


def target_complaint(target: Target, firmware: str) -> str:
    """Return why `firmware` does not run on `target`, "" if it does."""
    from firmware_sim.cortex_m.program import check_clock

    if target.name not in TARGETS:
        return f"no such target; {near(target.name, TARGETS)}"
    if target.name == "host" and firmware.endswith(ELF):
        return 'an .elf file is for the emulated processor: expected "cortex_m4", or leave it out'
    if target.name == "host" and target != Target():
        return 'clock_hz and cycles_per_instruction are those of an emulated processor: expected "cortex_m4" with them'
    try:
        check_clock(target.clock_hz, target.cycles_per_instruction, 0)
    except ValueError as error:
        return str(error)
    return ""
