"""tshark, as tests let it read captures; they are skipped where it is not installed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

import netem.records

TSHARK = shutil.which("tshark")
DISSECTOR = Path(netem.records.__path__[0], "marconet.lua")
needs_tshark = pytest.mark.skipif(TSHARK is None, reason="needs tshark: `apt-get install tshark`")


def fields(capture: Path, *names: str, where: str = "") -> list[list[str]]:
    """Return the values of the fields, as text, of each packet that the display filter `where` lets pass."""
    words = [str(TSHARK), "-n", "-X", f"lua_script:{DISSECTOR}", "-r", str(capture), "-T", "fields", "-E",
             "separator=/t", "-E", "aggregator=;"]
    for name in names:
        words += ["-e", name]
    done = subprocess.run([*words, *(["-Y", where] if where else [])], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    told = [line for line in done.stderr.splitlines() if "root" not in line]
    assert told == [], done.stderr
    return [line.split("\t") for line in done.stdout.splitlines()]
