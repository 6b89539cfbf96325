"""MAVLink's headers in C come from pymavlink's generator once, for every dialect that pymavlink has."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import minimal

from firmware_sim.firmware.build import build_for_host
from firmware_sim.firmware.errors import FirmwareError
from firmware_sim.firmware.new_folder import write_new
from firmware_sim.mavlink.c_headers import c_headers


def test_headers_are_generated_once_and_have_the_messages_of_the_dialect(tmp_path: Path, capsys) -> None:
    folder = c_headers("minimal", tmp_path)
    written_ns = (folder / "minimal" / "mavlink.h").stat().st_mtime_ns

    found = {int(number): int(extra) for number, extra in re.findall(
        r"define MAVLINK_MSG_ID_(\d+)_CRC (\d+)", "".join(path.read_text() for path in folder.rglob("*.h")))}
    again = c_headers("minimal", tmp_path)

    assert found == {number: kind.crc_extra for number, kind in minimal.mavlink_map.items()}
    assert (again, (again / "minimal" / "mavlink.h").stat().st_mtime_ns) == (folder, written_ns)
    assert capsys.readouterr() == ("", "")


def test_an_unknown_dialect_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    write_new(tmp_path / "blinker")
    table = tmp_path / "blinker" / "firmware.toml"
    table.write_text('mavlink = "comon"\n' + table.read_text())

    with pytest.raises(FirmwareError, match=r"firmware\.toml: mavlink='comon': no dialect of MAVLink: .*common"):
        build_for_host(tmp_path / "blinker")
