"""DBC files that cannot be used: each error names the file, the line and what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from firmware_sim.drive_controller.drive_messages import DRIVE_DBC, DriveMessages
from netem.media.can.dbc_file import LAYOUT_REMEDY, REMEDY, DbcError, read_dbc

GOOD = DRIVE_DBC.read_text(encoding="cp1252")


COLUMN = 1 + len(" SG_ right_radps : 24|24@1- (0.0001,0 ")       # of what cannot stand there


def line_of(text: str, part: str) -> int:
    return next(number for number, line in enumerate(text.splitlines(), 1) if part in line)


def refusal(tmp_path: Path, text: str) -> str:
    file = tmp_path / "own.dbc"
    file.write_bytes(text.encode("cp1252"))
    with pytest.raises(DbcError) as caught:
        DriveMessages(file)
    said = str(caught.value)
    assert said.startswith(f"{file}: ")
    return said.removeprefix(f"{file}: ")


def test_the_file_that_comes_with_marconet_can_be_used() -> None:
    assert {message.name for message in read_dbc(DRIVE_DBC).database.messages} == {
        "DriveSetpoint", "DriveSpeed", "DriveOdometry", "DriveStatus"}


def test_a_slip_of_the_pen_is_named_with_line_column_and_remedy(tmp_path: Path) -> None:
    broken = GOOD.replace("24|24@1- (0.0001,0) [-500|500]", "24|24@1- (0.0001,0 [-500|500]")

    line = line_of(broken, "(0.0001,0 [-500")
    assert refusal(tmp_path, broken) == (f'line {line}, column {COLUMN}: not DBC: SG_ right_radps : 24|24@1- (0.0001,0 '
                                         f'<here> [-500|500] "rad/s" DRIVE; {REMEDY}')


@pytest.mark.parametrize(("text", "says"), [
    ("", "the file is empty; expected a DBC file"),
    ("what is this?", "line 1, column 13: not DBC: what is this <here> ?"),
    ("\x00\x01\x02" * 50, "line 1, column 1: not DBC: "),
    (GOOD[:len(GOOD) // 3], "line "),
    ('VERSION ""\nBO_ 1 A: 8 X\n SG_ a : 0|8@1+ (1,0) [0|0] "" X\n', "no message DriveSetpoint; add it as in"),
    (GOOD.replace("BO_ 400 DriveSpeed", "BO_ 400 DriveSpeeds"), "no message DriveSpeed (the nearest is DriveSpeeds); "),
    (GOOD.replace("_ 1808", "_ 2050"), f"line {line_of(GOOD, 'BO_ 1808')}: Standard frame id 0x802 is more than 11"),
    (GOOD.replace("VAL_ 1808", "VAL_ 1809"), f"line {line_of(GOOD, 'VAL_ 1808')}: unused VAL_ entries in DBC: VAL_ 18"),
    (GOOD.replace("_ 1808", "_ 416"), "messages DriveOdometry and DriveStatus have the same identifier 0x1a0, lines "),
])
def test_what_is_no_file_of_drive_messages_is_refused(text: str, says: str, tmp_path: Path) -> None:
    assert refusal(tmp_path, text).startswith(says)


def test_signals_that_overlap_are_found_in_their_line(tmp_path: Path) -> None:
    broken = GOOD.replace("24|24@1- (0.0001,0) [-500|500]", "16|24@1- (0.0001,0) [-500|500]")

    said = refusal(tmp_path, broken)

    assert said.startswith(f"line {line_of(broken, '16|24@1-')}: ")
    assert "overlapping in message DriveSetpoint" in said


def test_a_signal_beyond_its_message_is_found_in_its_line(tmp_path: Path) -> None:
    broken = GOOD.replace("BO_ 416 DriveOdometry: 8", "BO_ 416 DriveOdometry: 7")

    assert refusal(tmp_path, broken).startswith(
        f"line {line_of(broken, 'right_count')}: The signal right_count does not fit in message DriveOdometry; ")


@pytest.mark.parametrize(("old", "new", "says"), [
    ("SG_ left_count", "SG_ left_counts", "line {}: message DriveOdometry has no signal left_count (the nearest is "
                                          "left_counts); add it as in"),
    ('SG_ age_ms : 32|32@1+ (1,0) [0|4294967295] "ms" COMPANION',
     'SG_ age_ms : 32|24@1+ (1,0) [0|1] "ms" COMPANION\n SG_ more : 56|8@1+ (1,0) [0|1] "" COMPANION',
     "line {}: message DriveStatus: marconet's drive does not fill the signal more; leave it out"),
    ("SG_ counter : 56|8@1+ (1,0) [0|255] \"\" COMPANION", "SG_ counter m1 : 56|8@1+ (1,0) [0|255] \"\" COMPANION",
     "line {}: "),
])
def test_a_message_with_other_signals_is_named_with_its_line(old: str, new: str, says: str, tmp_path: Path) -> None:
    assert old in GOOD
    broken = GOOD.replace(old, new)
    if "m1" in new:
        broken = broken.replace("SG_ state : 48|8", "SG_ state M : 48|8")

    message = {"SG_ left_count": "BO_ 416"}.get(old, "BO_ 1808" if "age_ms" in old else "BO_ 400")
    assert refusal(tmp_path, broken).startswith(says.format(line_of(broken, message)))


def test_a_message_longer_than_classical_can_is_refused(tmp_path: Path) -> None:
    said = refusal(tmp_path, GOOD.replace("BO_ 416 DriveOdometry: 8", "BO_ 416 DriveOdometry: 12"))

    assert said == "message DriveOdometry has 12 bytes; classical CAN carries at most 8"


def test_a_unit_beyond_the_last_identifier_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "own.dbc"
    file.write_text(GOOD.replace("_ 1808", "_ 2040"), encoding="cp1252")

    assert DriveMessages(file, unit=7).identifiers()[-1] == (2047, False)
    with pytest.raises(DbcError, match="message DriveStatus: unit 8 would have the identifier 0x800, beyond 11 bits"):
        DriveMessages(file, unit=8)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(DbcError, match=r"none.dbc: cannot be read \(No such file or directory\); give the path"):
        DriveMessages(tmp_path / "none.dbc")


VEHICLES = Path(__file__).parents[3] / "cases" / "drive_dbc" / "dbc"
USABLE = ("plain", "crlf", "utf8_bom", "degree_cp1252", "motorola", "extended_ids", "offset", "negative_scale",
          "no_range", "no_nodes", "float_signal", "long_name", "other_message_overlaps", "other_message_3digit_name")
REFUSED = {
    "same_name_twice": "message DriveSetpoint stands there twice, lines 9, 31; leave one",
    "same_id_twice": "messages DriveSetpoint and Other have the same identifier 0x110, lines 9, 31; give each its own",
    "dlc_6_of_8": f"line 12: The signal mode does not fit in message DriveSetpoint; {LAYOUT_REMEDY}",
    "extra_checksum_signal": "line 15: The signals checksum and mode are overlapping in message DriveSetpoint; "
                             + LAYOUT_REMEDY,
    "e2e_checksum": "line 9: message DriveSetpoint: marconet's drive does not fill the signal checksum; leave it out",
    "multiplexed": "line 9: message DriveSetpoint is multiplexed; give each signal a place of its own",
    "fd_64": "message DriveSetpoint has 64 bytes; classical CAN carries at most 8",
    "empty": "the file is empty; expected a DBC file",
}


def test_every_file_of_a_vehicle_is_tried() -> None:
    assert {file.stem for file in VEHICLES.glob("*.dbc")} == {*USABLE, *REFUSED}


@pytest.mark.parametrize("name", USABLE)
def test_a_vehicles_file_is_usable_whatever_other_messages_it_holds(name: str) -> None:
    messages = DriveMessages(VEHICLES / f"{name}.dbc")

    assert len(messages.identifiers()) == 4


@pytest.mark.parametrize("name", REFUSED)
def test_a_vehicles_file_is_refused_for_the_drives_own_messages_only(name: str) -> None:
    file = VEHICLES / f"{name}.dbc"

    with pytest.raises(DbcError) as caught:
        DriveMessages(file)

    assert str(caught.value) == f"{file}: {REFUSED[name]}"


def test_a_message_that_is_not_dbc_is_left_out_with_all_that_refers_to_it(tmp_path: Path) -> None:
    file = tmp_path / "vehicle.dbc"
    file.write_text(GOOD + 'BO_ 1275 2017_5: 8 XXX\n SG_ a : 0|8@1+ (1,0) [0|1] "" XXX\n\n'
                    'CM_ SG_ 1275 a "of two\nlines; and more";\nVAL_ 1275 a 0 "no" ;\n', encoding="utf-8")

    found = read_dbc(file)

    line = line_of(file.read_text(), "2017_5")
    assert found.left_out == {"2017_5": f"line {line}, column 10: not DBC: BO_ 1275 <here> 2017_5: 8 XXX"}
    assert {message.name for message in found.database.messages} == {
        "DriveSetpoint", "DriveSpeed", "DriveOdometry", "DriveStatus"}
    with pytest.raises(DbcError, match=f"line {line}, column 10: not DBC: .* {REMEDY}"):
        found.usable_message("2017_5")
