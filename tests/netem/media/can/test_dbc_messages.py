"""A bus whose messages a DBC file declares: periods and senders from the file, odd messages passed over."""

from __future__ import annotations

from pathlib import Path

import pytest

from netem.media.can.dbc_file import DbcError
from netem.media.can.messages import CanMessage
from netem.media.can.settings import CanSettings
from tests.netem.media.can.can_bench import MS

NODES = ("engine", "brake", "gateway")
HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: ENGINE BRAKE RADIO\n\n'
BODY = """BO_ 256 Speed: 8 ENGINE
 SG_ rpm : 0|16@1+ (1,0) [0|8000] "" BRAKE

BO_ 2566844672 Torque: 6 ENGINE
 SG_ nm : 0|16@1- (1,0) [0|0] "" BRAKE

BO_ 512 Pressure: 4 BRAKE
 SG_ a : 0|8@1+ (1,0) [0|255] "" ENGINE
 SG_ b : 4|8@1+ (1,0) [0|255] "" ENGINE

BO_ 768 Station: 8 RADIO

BO_ 1024 OnDemand: 8 ENGINE

BO_ 1275 2017_5: 8 ENGINE

BO_ 1280 First: 1 ENGINE

BO_ 1280 Second: 1 BRAKE

BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 256 10;
BA_ "GenMsgCycleTime" BO_ 2566844672 20;
BA_ "GenMsgCycleTime" BO_ 512 100;
BA_ "GenMsgCycleTime" BO_ 768 50;
BA_ "GenMsgCycleTime" BO_ 1275 50;
BA_ "GenMsgCycleTime" BO_ 1280 50;
"""


@pytest.fixture
def vehicle(tmp_path: Path) -> Path:
    file = tmp_path / "vehicle.dbc"
    file.write_text(HEAD + BODY)
    return file


def test_cycle_times_and_senders_are_the_files(vehicle: Path) -> None:
    found = CanSettings(500_000, dbc=vehicle).with_declared(NODES)

    assert found.messages == {"Speed": CanMessage(256, 10 * MS, "engine", 8),
                              "Torque": CanMessage(0x18FEF100, 20 * MS, "engine", 6, extended=True),
                              "Pressure": CanMessage(512, 100 * MS, "brake", 4)}


def test_an_own_message_goes_first_and_a_unit_may_be_named_for_a_node(vehicle: Path) -> None:
    own = {"Speed": CanMessage(256, 5 * MS, "gateway", 8), "mine": CanMessage(512, 7 * MS, "brake", 8)}

    found = CanSettings(500_000, dbc=vehicle, messages=own, dbc_nodes={"RADIO": "gateway"}).with_declared(NODES)

    assert found.messages == own | {"Torque": CanMessage(0x18FEF100, 20 * MS, "engine", 6, extended=True),
                                    "Station": CanMessage(768, 50 * MS, "gateway", 8)}


def test_check_shows_load_bounds_and_what_was_passed_over(vehicle: Path) -> None:
    bounds, passed_over = CanSettings(500_000, dbc=vehicle).shown("can", NODES)

    assert bounds.title.startswith("can: declared messages need ")
    assert [row[:4] for row in bounds.rows] == [("Speed", "0x100", "engine", "10 ms"),
                                                ("Pressure", "0x200", "brake", "100 ms"),
                                                ("Torque", "0x18fef100", "engine", "20 ms")]
    assert dict(passed_over.rows) == {
        "2017_5": "line 23, column 10: not DBC: BO_ 1275 <here> 2017_5: 8 ENGINE",
        "Station": "sent by RADIO, not on this bus", "OnDemand": "no cycle time",
        "First": "identifier 0x500 stands there twice", "Second": "identifier 0x500 stands there twice"}


def test_more_than_the_bus_carries_is_refused_with_the_number(vehicle: Path) -> None:
    with pytest.raises(ValueError, match=r"bit_rate_bps=10000: the 3 declared messages need 2\d\d\.\d% of it"):
        CanSettings(10_000, dbc=vehicle).with_declared(NODES)


def test_a_file_that_is_not_there_and_a_node_that_is_not_there_are_named(tmp_path: Path) -> None:
    with pytest.raises(DbcError, match=r"none\.dbc: cannot be read"):
        CanSettings(500_000, dbc=tmp_path / "none.dbc").with_declared(NODES)
    with pytest.raises(ValueError, match="dbc_nodes: ENGINE=motor: no such node on this bus; there are engine, brake"):
        CanSettings(500_000, dbc_nodes={"ENGINE": "motor"}).check_nodes("can", NODES)
