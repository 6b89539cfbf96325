"""board_ids.h: the numbers of everything that a firmware names, generated from its firmware.toml.

    PORT_RADIO 0u    PARAMETER_PERIOD_NS 0u    SENSOR_Y 0u (entries: SENSOR_Y + k)    COUNTER_LOST_FRAMES 0u    ...
"""

from __future__ import annotations

from collections.abc import Iterable

from firmware_sim.firmware.description import Firmware, identifier


def ids_header(firmware: Firmware) -> str:
    """Return the text of board_ids.h."""
    sections = [("PORT", [(row.name, 1, row.about) for row in firmware.ports]),
                ("PARAMETER", [*((row.name, 1, row.about) for row in firmware.parameters),
                               *((row.name, 1, row.about) for row in firmware.configuration)]),
                ("SENSOR", [(row.name, row.entries or 1, _with_unit(row.about, row.unit)) for row in firmware.sensors]),
                ("ACTUATOR", [(row.name, row.entries or 1, _with_unit(row.about, row.unit))
                              for row in firmware.actuators]),
                ("COUNTER", [(row.name, 1, row.about) for row in firmware.counters]),
                ("SIGNAL", [(row.name, 1, _with_unit(row.about, row.unit)) for row in firmware.signals]),
                ("EVENT", [(row.name, 1, row.about) for row in firmware.events])]
    lines = [f"/* board_ids.h: numbers of what {firmware.name} names, generated from its firmware.toml; do not edit */",
             "#ifndef BOARD_IDS_H", "#define BOARD_IDS_H", ""]
    for kind, rows in sections:
        lines += [*_macros(kind, rows), ""]
    return "\n".join([*lines, "#endif", ""])


def _macros(kind: str, rows: Iterable[tuple[str, int, str]]) -> Iterable[str]:
    number = 0
    for name, entries, about in rows:
        comment = about.replace("*/", "* /")
        yield f"#define {kind}_{identifier(name)} {number}u" + (f"    /* {comment} */" if comment else "")
        if entries > 1:
            yield f"#define {kind}_{identifier(name)}_ENTRIES {entries}u"
        number += entries
    yield f"#define {kind}S_DECLARED {number}u"


def _with_unit(about: str, unit: str) -> str:
    return f"{about} [{unit}]".strip() if unit else about
