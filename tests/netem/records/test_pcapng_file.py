"""Captures: read by python-pcapng and by tshark as they were meant, and what these two write is read by us."""

from __future__ import annotations

import io
import shutil
import subprocess
from pathlib import Path

import pcapng
import pytest
from pcapng import blocks

from netem.media.can.captured import ERROR_FRAME, LINK_TYPE, captured, offered
from netem.media.can.frame import CanFrame, MalformedFrame, pack
from netem.records.pcapng_file import LONGEST_COMMENT, BadCapture, Interface, Packet, PcapngWriter, read_packets
from tests.netem.records.capture import fields, needs_tshark

INTERFACES = [Interface("radio", 147), Interface("bus", LINK_TYPE)]
FRAMES = [CanFrame(0x123, b"\x01\x02"), CanFrame(0x1ABCDEF0, b"12345678", extended=True), CanFrame(0x7FF),
          CanFrame(0x10, bytes(range(24)), fd=True, bit_rate_switch=True, error_state=True),
          CanFrame(0x321, remote=True, dlc=4)]
PACKETS = [Packet(0, "radio", 147, b"\xfd\x00", "sender=r1 number=0 | r2: delivered at 5 ns"),
           Packet(1_234_567_891_234_567_891, "radio", 147, b"", ""), Packet(7, "radio", 147, bytes(2000), "ä | ö"),
           *(Packet(10 + k, "bus", LINK_TYPE, captured(pack(frame)), "") for k, frame in enumerate(FRAMES)),
           Packet(99, "bus", LINK_TYPE, ERROR_FRAME, "error frame on bus")]


def written(path: Path, packets: list[Packet]) -> Path:
    stream = io.BytesIO()
    writer = PcapngWriter(stream, INTERFACES)
    for packet in packets:
        writer.packet([each.name for each in INTERFACES].index(packet.interface), packet.time_ns, packet.data,
                      packet.comment)
    path.write_bytes(stream.getvalue())
    return path


def test_packets_read_back_as_they_were(tmp_path: Path) -> None:
    assert list(read_packets(written(tmp_path / "a.pcapng", PACKETS))) == PACKETS


LIBRARYS_OWN = pytest.mark.filterwarnings("ignore:Field type should not be:DeprecationWarning")


@LIBRARYS_OWN
def test_another_library_reads_the_same(tmp_path: Path) -> None:
    with written(tmp_path / "a.pcapng", PACKETS).open("rb") as file:
        section, *described = (block for block in pcapng.FileScanner(file))
    found = [block for block in described if isinstance(block, blocks.EnhancedPacket)]

    assert section.options["shb_userappl"] == "marconet"
    assert [(block.interface.options["if_name"], block.interface.link_type) for block in found] == [
        (packet.interface, packet.link_type) for packet in PACKETS]
    assert {block.interface.options["if_tsresol"] for block in found} == {b"\x09"}
    assert [(block.timestamp_high << 32 | block.timestamp_low, bytes(block.packet_data),
             block.options.get("opt_comment", "")) for block in found] == [
        (packet.time_ns, packet.data, packet.comment) for packet in PACKETS]


@LIBRARYS_OWN
@pytest.mark.parametrize(("order", "resolution", "ticks", "time_ns"), [
    ("<", b"\x09", 123_456_789_012, 123_456_789_012), (">", b"\x06", 5_000_001, 5_000_001_000),
    (">", b"\x83", 9, 1_125_000_000), ("<", None, 7, 7_000), ("<", b"\x0a", 12_345, 1_234)])
def test_captures_of_another_library_are_read(tmp_path: Path, order: str, resolution: bytes | None, ticks: int,
                                              time_ns: int) -> None:
    stream = io.BytesIO()
    section = blocks.SectionHeader(endianness=order)
    section.new_member(blocks.InterfaceDescription, link_type=147, options={"if_name": "radio"} | (
        {} if resolution is None else {"if_tsresol": resolution}))
    writer = pcapng.FileWriter(stream, section)
    writer.write_block(section.new_member(
        blocks.EnhancedPacket, interface_id=0, timestamp_high=ticks >> 32, timestamp_low=ticks & 0xFFFFFFFF,
        packet_len=3, packet_data=b"abc", options={"opt_comment": "word"}))
    (tmp_path / "b.pcapng").write_bytes(stream.getvalue())

    assert list(read_packets(tmp_path / "b.pcapng")) == [Packet(time_ns, "radio", 147, b"abc", "word")]


def test_a_comment_is_cut_where_the_format_ends(tmp_path: Path) -> None:
    packet = PACKETS[0]._replace(comment="ä" * 40_000)

    found, = read_packets(written(tmp_path / "a.pcapng", [packet]))

    assert len(found.comment.encode()) in (LONGEST_COMMENT, LONGEST_COMMENT - 1)
    assert set(found.comment) == {"ä"}


def test_can_frames_come_back_as_a_port_takes_them() -> None:
    assert [offered(captured(pack(frame))) for frame in FRAMES] == [pack(frame) for frame in FRAMES]
    assert offered(captured(b"")) is None


@pytest.mark.parametrize("packet", [b"", b"\0" * 7, b"\0\0\1\x23\x08\0\0\0abc", b"\0\0\1\x23\x09\0\0\0" + bytes(9),
                                    b"\0\0\1\x23\x09\x04\0\0" + bytes(9), b"\xff\xff\xff\x00\x41\x04\0\0" + bytes(99)])
def test_no_other_bytes_are_a_can_frame(packet: bytes) -> None:
    if packet[:1] == b"\xff":
        assert offered(packet) is None              # ERR
    else:
        with pytest.raises(MalformedFrame):
            offered(packet)


@needs_tshark
def test_wireshark_reads_times_interfaces_comments_and_can_frames(tmp_path: Path) -> None:
    path = written(tmp_path / "a.pcapng", PACKETS)

    rows = fields(path, "frame.time_epoch", "frame.interface_name", "frame.len")
    assert rows == [[f"{packet.time_ns // 10**9}.{packet.time_ns % 10**9:09d}", packet.interface, str(len(packet.data))]
                    for packet in PACKETS]
    assert [row[0] for row in fields(path, "frame.comment")] == [packet.comment for packet in PACKETS]
    can = fields(path, "can.id", "can.len", "can.flags.xtd", "can.flags.rtr", "can.flags.err", "canfd.flags.brs",
                 "data.data", where="can || canfd")
    assert [row[:2] for row in can[:5]] == [
        [str(frame.can_id), str(frame.dlc if frame.remote else len(frame.data))] for frame in FRAMES]
    assert [row[2] for row in can[:5]] == [str(int(frame.extended)) for frame in FRAMES]
    assert [row[3] for row in can[:3]] + [can[4][3]] == ["0", "0", "0", "1"]
    assert can[3][5:] == ["1", bytes(range(24)).hex()]
    assert can[5][1:5] == ["8", "", "", "1"]


@needs_tshark
def test_the_dissector_makes_fields_of_the_comment(tmp_path: Path) -> None:
    comment = ("sender=r1 number=9007199254740993 slot=3 offered_ns=1234567890123456789 on_air_ns=2 end_ns=3 seen_ns=4 "
               "| r2: delivered at 1234567890123456789 ns | r-3: lost (impairments[0] scripted (x): y) "
               "| r4 copy 1: delivered corrupt at 8 ns | r5: too weak")
    path = written(tmp_path / "a.pcapng", [PACKETS[0]._replace(comment=comment), PACKETS[-1], PACKETS[1]])

    names = ("medium", "sender", "number", "slot", "offered_ns", "receiver", "copy", "fate", "delivered_ns", "cause",
             "error_frame")
    rows = fields(path, *(f"marconet.{name}" for name in names))

    assert rows[0] == ["radio", "r1", "9007199254740993", "3", "1234567890123456789", "r2;r-3;r4;r5", "1",
                       "delivered;lost;delivered corrupt;too weak", "1234567890123456789;8",
                       "impairments[0] scripted (x): y", ""]
    assert rows[1][-1] == "error frame on bus"
    assert set(rows[2]) == {""}
    assert len(fields(path, "frame.number", where='marconet.sender == "r1" && marconet.fate == "too weak"')) == 1


@needs_tshark
@pytest.mark.skipif(shutil.which("editcap") is None, reason="needs editcap, which comes with tshark")
def test_a_capture_that_wireshark_wrote_is_read(tmp_path: Path) -> None:
    path = written(tmp_path / "a.pcapng", PACKETS)

    subprocess.run(["editcap", "-F", "pcapng", str(path), str(tmp_path / "b.pcapng")], check=True, capture_output=True)

    assert list(read_packets(tmp_path / "b.pcapng")) == PACKETS


@pytest.mark.parametrize("damage", ["empty", "cut", "foreign", "classic", "huge block"])
def test_other_files_are_an_error_of_one_line(tmp_path: Path, damage: str) -> None:
    good = written(tmp_path / "a.pcapng", PACKETS).read_bytes()
    block = good[:-16] + b"\6\0\0\0" + b"\xf0\xff\xff\x7f" + bytes(8)
    path = tmp_path / "b.pcapng"
    path.write_bytes({"empty": b"", "cut": good[:-5], "foreign": b"(0.1) can0 123#", "huge block": block,
                      "classic": bytes.fromhex("d4c3b2a1020004000000000000000000ffff000001000000")}[damage])

    if damage == "empty":
        assert list(read_packets(path)) == []
        return
    with pytest.raises(BadCapture, match=r"b\.pcapng: behind packet \d+: .*`editcap -F pcapng IN OUT`") as error:
        list(read_packets(path))
    assert "\n" not in str(error.value)
