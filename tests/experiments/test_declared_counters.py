"""Every counter that a program, board or medium of ours counts is declared at 0 before it is counted."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COUNTED = re.compile(r"""(?:\.count\(|counters\[\w+\]\[|counters\[|counts\[)"([^"{\\]+)"(?:\] \+=|[,)])""")
BY_HOST = {"garbage grants"}            # of a robot's own process; there are none in an inline run


def declared_in(folder: str) -> str:
    """The text of the tuples of counters and of the calls that declare one."""
    text = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / folder).rglob("*.py"))
    tuples = re.findall(r"COUNTERS(?:: Final)? = \((.*?)\)\n", text, re.DOTALL)
    loops = re.findall(r"for (?:counter|what) in \((.*?)\):", text)
    return "\n".join([*tuples, *loops, *re.findall(r'\.count\("[^"]+", 0\)', text)])


@pytest.mark.parametrize("folder", ["agents/synchronization", "agents/tracking", "agents/pursuit",
                                    "firmware_sim/autopilot", "firmware_sim/drive_controller", "firmware_sim/mavlink",
                                    "netem/media/can", "netem/media/serial_line",
                                    "agents/teleoperation", "agents/servo"])
def test_what_is_counted_is_declared(folder: str) -> None:
    declared = declared_in(folder)
    counted = {name for path in (ROOT / folder).rglob("*.py")
               for name in COUNTED.findall(path.read_text(encoding="utf-8"))} - BY_HOST

    assert counted
    assert [name for name in sorted(counted) if f'"{name}"' not in declared] == []
