"""The same programs on the library and in virtual time tell the same, where time does not matter."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.firmware_sim.zenoh_programs.runs import LAN, really, virtually

PAIRS = {"puts": {"right": "parity:puts_right", "left": "parity:puts_left"},
         "queries": {"right": "parity:queries_right", "left": "parity:queries_left"},
         "alive": {"right": "parity:alive_right", "left": "parity:alive_left"},
         "alone": {"right": "parity:alone"}}


@pytest.mark.parametrize("pair", PAIRS)
def test_two_programs_tell_the_same(tmp_path: Path, pair: str) -> None:
    virtual = virtually(tmp_path / "v", PAIRS[pair], LAN)

    assert virtual == really(PAIRS[pair])
    assert any(virtual.values())
