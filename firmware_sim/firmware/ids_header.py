"""board_ids.h: the numbers of everything that a firmware names, generated from its firmware.toml.

    PORT_RADIO 0u    PARAMETER_PERIOD_NS 0u    SENSOR_Y 0u (entries: SENSOR_Y + k)    COUNTER_LOST_FRAMES 0u    ...
"""

from __future__ import annotations

from collections.abc import Iterator

from firmware_sim.firmware.description import Firmware, identifier


def declared(firmware: Firmware) -> Iterator[tuple[str, int, str]]:
    """Yield every macro of board_ids.h: name, number and what it stands for."""
    for kind, rows in _sections(firmware).items():
        number = 0
        for name, entries, about in rows:
            yield f"{kind}_{identifier(name)}", number, about
            if entries > 1:
                yield f"{kind}_{identifier(name)}_ENTRIES", entries, ""
            number += entries
        yield f"{kind}S_DECLARED", number, ""


def ids_header(firmware: Firmware) -> str:
    """Return the text of board_ids.h."""
    lines = [f"/* board_ids.h: numbers of what {firmware.name} names, generated from its firmware.toml; do not edit */",
             "#ifndef BOARD_IDS_H", "#define BOARD_IDS_H", ""]
    for macro, number, about in declared(firmware):
        comment = about.replace("*/", "* /")
        lines.append(f"#define {macro} {number}u" + (f"    /* {comment} */" if comment else ""))
        if macro.endswith("S_DECLARED"):
            lines.append("")
    return "\n".join([*lines, "#endif", ""])


def _sections(firmware: Firmware) -> dict[str, list[tuple[str, int, str]]]:
    """Return name, number of entries and meaning of all rows, by the kind that begins their macros."""
    return {"PORT": [(row.name, 1, row.about) for row in firmware.ports],
            "PARAMETER": [*((row.name, 1, row.about) for row in firmware.parameters),
                          *((row.name, 1, row.about) for row in firmware.configuration)],
            "SENSOR": [(row.name, row.entries or 1, _with_unit(row.about, row.unit)) for row in firmware.sensors],
            "ACTUATOR": [(row.name, row.entries or 1, _with_unit(row.about, row.unit)) for row in firmware.actuators],
            "COUNTER": [(row.name, 1, row.about) for row in firmware.counters],
            "SIGNAL": [(row.name, 1, _with_unit(row.about, row.unit)) for row in firmware.signals],
            "EVENT": [(row.name, 1, row.about) for row in firmware.events]}


def _with_unit(about: str, unit: str) -> str:
    return f"{about} [{unit}]".strip() if unit else about
