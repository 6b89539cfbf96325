"""Logs of a CAN bus, read back with python-can's own readers."""

import re
from pathlib import Path

import can
import pytest

from netem.core.frame import Frame
from netem.media.can.can_log import CanLog
from netem.media.can.can_log_reader import read_can_log
from netem.media.can.frame import CanFrame, pack, unpack
from netem.media.can.settings import CanLogSettings, CanSettings
from netem.records import Feed, Place
from netem.records.table import RECORDERS
from netem.wire.instants import NEVER_NS

FRAMES = [CanFrame(0x123, b"\x01\x02"), CanFrame(0x1ABCDEF0, b"12345678", extended=True), CanFrame(0x7FF),
          CanFrame(0x10, bytes(range(24)), fd=True, bit_rate_switch=True, error_state=True),
          CanFrame(0x11, b"abc", extended=True, fd=True)]
TIMES_NS = [0, 1_234_567, 1_000_000_001, 59_999_999_999, 86_400_000_000_123]
READERS = {"candump": (can.CanutilsLogReader, "can0.log", 500.0), "blf": (can.BLFReader, "can0.blf", 1.0),
           "asc": (can.ASCReader, "can0.asc", 500.0)}


def log(folder: Path, name: str, end_ns: int = NEVER_NS) -> CanLog:
    written: CanLog = RECORDERS[name](CanLogSettings("can0"), Place(folder, {}, b"", end_ns))
    feed = Feed({"can0": []})
    written.record(feed)
    assert feed.frames == {"can0": [written]}
    return written


def frame(can_frame: CanFrame) -> Frame:
    return Frame("can0", "a", 0, 0, pack(can_frame))


@pytest.mark.parametrize("name", READERS)
def test_frames_read_back_as_they_were_with_their_times(name: str, tmp_path: Path) -> None:
    """candump prints microseconds; BLF nanoseconds, made from a float of seconds: 15 ns in a day (2^-36 s)."""
    written = log(tmp_path, name)
    for time_ns, sent in zip(TIMES_NS, FRAMES, strict=True):
        written.frame(frame(sent), time_ns)
    written.finish()
    reader, file, resolution_ns = READERS[name]

    messages = list(reader(tmp_path / file))

    assert [(message.arbitration_id, message.is_extended_id, bytes(message.data), message.is_fd,
             message.bitrate_switch, message.error_state_indicator) for message in messages] == [
        (sent.can_id, sent.extended, sent.data, sent.fd, sent.bit_rate_switch, sent.error_state) for sent in FRAMES]
    for message, time_ns in zip(messages, TIMES_NS, strict=True):
        assert abs(message.timestamp * 1e9 - time_ns) <= resolution_ns + 2 * time_ns * 2.0**-52


@pytest.mark.parametrize("name", READERS)
def test_remote_and_error_frames_are_marked(name: str, tmp_path: Path) -> None:
    written = log(tmp_path, name)
    written.frame(frame(CanFrame(0x321, remote=True, dlc=4)), 10**6)
    written.error_frame("can0", 2 * 10**6)
    written.finish()
    reader, file, _ = READERS[name]

    remote, error = reader(tmp_path / file)

    assert (remote.is_remote_frame, remote.arbitration_id, remote.is_error_frame) == (True, 0x321, False)
    assert (error.is_remote_frame, error.is_error_frame) == (False, True)
    assert error.timestamp == pytest.approx(0.002, abs=1e-6)


def test_a_candump_log_is_what_the_tools_of_linux_print(tmp_path: Path) -> None:
    written = log(tmp_path, "candump")
    written.frame(frame(CanFrame(0x123, b"\xde\xad\xbe\xef")), 1_234_567_000)
    written.finish()

    assert (tmp_path / "can0.log").read_text().split()[:3] == ["(1.234567)", "can0", "123#DEADBEEF"]


@pytest.mark.parametrize("name", READERS)
def test_what_would_end_after_the_run_is_not_logged(name: str, tmp_path: Path) -> None:
    written = log(tmp_path, name, end_ns=1000)
    written.frame(frame(CanFrame(1)), 999)
    written.frame(frame(CanFrame(2)), 1000)
    written.finish()
    reader, file, _ = READERS[name]

    assert len(list(reader(tmp_path / file))) == 1


@pytest.mark.parametrize("name", ["csv", "trc"])
def test_formats_that_know_less_read_back_what_they_know(name: str, tmp_path: Path) -> None:
    """TRC prints microseconds; CSV a float of seconds. Neither has CAN FD, TRC neither remote nor error frames."""
    written = log(tmp_path, name)
    for time_ns, sent in zip(TIMES_NS[:3], FRAMES[:3], strict=True):
        written.frame(frame(sent), time_ns)
    written.frame(frame(CanFrame(0x321, remote=True, dlc=4)), 2 * 10**9)
    written.error_frame("can0", 3 * 10**9)
    written.finish()
    reader, file = {"csv": (can.CSVReader, "can0.csv"), "trc": (can.TRCReader, "can0.trc")}[name]

    messages = list(reader(tmp_path / file))

    assert [(message.arbitration_id, message.is_extended_id, bytes(message.data)) for message in messages[:3]] == [
        (sent.can_id, sent.extended, sent.data) for sent in FRAMES[:3]]
    for message, time_ns in zip(messages, TIMES_NS[:3], strict=False):
        assert abs(message.timestamp * 1e9 - time_ns) <= 500 + 2 * time_ns * 2.0**-52
    assert [(message.is_remote_frame, message.is_error_frame) for message in messages[3:]] == {
        "csv": [(True, False), (False, True)], "trc": []}[name]


def test_trc_refuses_can_fd_and_says_what_to_use(tmp_path: Path) -> None:
    written = log(tmp_path, "trc")

    with pytest.raises(ValueError, match="CAN FD, which TRC has not; use asc or blf"):
        written.frame(frame(FRAMES[3]), 0)
    with pytest.raises(ValueError, match='"trc" has no frames of CAN FD'):
        CanSettings(500_000, 2_000_000, log=("trc",))
    written.finish()


@pytest.mark.parametrize("name", ["asc", "trc"])
def test_a_text_log_names_neither_the_date_nor_the_folder_of_the_machine(name: str, tmp_path: Path) -> None:
    written = log(tmp_path, name)
    written.frame(frame(FRAMES[0]), 5_000_000_000)
    written.finish()

    text = (tmp_path / f"can0.{name}").read_text()

    assert str(tmp_path) not in text
    assert "1970" in text
    assert re.findall(r"\b20\d\d\b", text) == []


@pytest.mark.parametrize("name", ["candump", "blf", "asc", "csv"])
def test_our_reader_gives_the_frames_of_a_port_back(name: str, tmp_path: Path) -> None:
    sent = [each for each in FRAMES if name != "csv" or not each.fd]
    written = log(tmp_path, name)
    for time_ns, each in zip(TIMES_NS, sent, strict=False):
        written.frame(frame(each), time_ns)
    written.frame(frame(CanFrame(0x321, remote=True, dlc=4)), TIMES_NS[-1])
    written.error_frame("can0", TIMES_NS[-1])
    written.finish()
    suffix = {"candump": "log"}.get(name, name)

    *read, remote, error = read_can_log(tmp_path / f"can0.{suffix}")

    assert [unpack(each.data)[:7] for each in read] == [each[:7] for each in sent]
    assert unpack(remote.data)[:4] == (0x321, b"", False, True)
    assert error.data == b""
    for each, time_ns in zip(read, TIMES_NS, strict=False):
        assert abs(each.time_ns - time_ns) <= 500 + 2 * time_ns * 2.0**-52
