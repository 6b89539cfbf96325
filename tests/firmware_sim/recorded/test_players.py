"""A recorded log drives a run again: frames are on the air at equal instants; wrong files and settings say why."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import pytest

import marconet
from experiments.run.export import export_frames
from firmware_sim.mavlink.dialect import layout_of, message, pack
from firmware_sim.mavlink.framing import build
from netem.media.can.can_log_reader import read_can_log
from netem.media.can.frame import unpack
from netem.records.frames_file import KeptFrame, frame_table, frames_of
from tests.experiments.run.recorded_team import EVERY_LOG, TABLES, team

CAPTURE, CAN_LOG, TLOG = (f"firmware_sim.recorded.{path}" for path in (
    "capture:CapturePlayer", "can_log:CanLogPlayer", "tlog:TlogPlayer"))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run; that of its scenario is above it."""
    folder = tmp_path_factory.mktemp("recorded")
    return marconet.run(team(folder, record=["frames", "pcapng"]), host="inline", out=folder / "run").folder


def play(folder: Path, program: str, host: Any = "inline", length_s: float = 0.3, media: Any = None,
         **parameters: Any) -> list[KeptFrame]:
    """Run the player `p` with a listener on its port; return the frames on the air."""
    scenario = scenario_of(folder, program, length_s, media, **parameters)
    found = marconet.run(scenario, host=host, out=folder / "again", overwrite=True).folder
    return list(frames_of(frame_table(found)))


def scenario_of(folder: Path, program: str, length_s: float = 0.3, media: Any = None, **parameters: Any
                ) -> marconet.Scenario:
    (folder / "listener.py").write_text("class Listener:\n    def __init__(self, board):\n        pass\n")
    media = media or {"radio": TABLES["media"]["radio"]}
    return marconet.Scenario("again", folder=folder, seed=1, length_s=length_s, record="frames", media=media, agents={
        "p": {"program": program, "parameters": parameters}, "q": {"program": "listener:Listener"}})


def on_air(frames: list[KeptFrame], medium: str) -> list[tuple[int, int, bytes]]:
    return [(frame.on_air_ns, frame.end_ns, frame.data) for frame in frames if frame.medium == medium]


@pytest.mark.parametrize("medium", ["radio", "bus", "line"])
@pytest.mark.parametrize("host", ["inline", "process"])
def test_a_capture_is_on_the_air_again_at_equal_instants(recorded: Path, tmp_path: Path, medium: str, host: str
                                                         ) -> None:
    first = [frame for frame in frames_of(frame_table(recorded)) if frame.medium == medium]
    senders = ["a"] if medium == "line" else []         # both ends of a line send at the same time

    again = play(tmp_path, CAPTURE, host, media={medium: {key: value for key, value in TABLES["media"][medium].items()
                                                          if key != "log"}},
                 file=str(recorded / "frames.pcapng"), interface=medium, senders=senders)

    wanted = [frame for frame in first if not senders or frame.sender in senders]
    assert on_air(again, medium) == on_air(wanted, medium)
    assert len(again) > 10
    assert {frame.sender for frame in again} == {"p"}


def test_senders_offset_and_loop(recorded: Path, tmp_path: Path) -> None:
    first = [frame for frame in frames_of(frame_table(recorded)) if (frame.medium, frame.sender) == ("radio", "b")]

    again = play(tmp_path, CAPTURE, file=str(recorded / "frames.pcapng"), interface="radio", senders=["b"],
                 offset_ms=7, from_first=True, loop_every_ms=250, length_s=0.6)

    start_ns = first[0].on_air_ns
    assert on_air(again, "radio") == [
        (frame.on_air_ns + shift_ns, frame.end_ns + shift_ns, frame.data) for round_ns in (0, 250_000_000, 500_000_000)
        for frame in first if (shift_ns := 7_000_000 - start_ns + round_ns) + frame.end_ns < 600_000_000]


@pytest.mark.parametrize("kind", EVERY_LOG)
def test_a_log_of_a_bus_is_handed_out_at_its_times(recorded: Path, tmp_path: Path, kind: str) -> None:
    log = recorded / ("bus." + {"candump": "log"}.get(kind, kind))

    again = play(tmp_path, CAN_LOG, media={"bus": {"kind": "can", "bit_rate_bps": 500_000}}, file=str(log),
                 identifiers=[2, 0x1ABCDE2])

    logged = [(each.time_ns, each.data) for each in read_can_log(log) if unpack(each.data).can_id in (2, 0x1ABCDE2)]
    assert [(frame.offered_ns, frame.data) for frame in again] == logged
    original = [frame for frame in frames_of(frame_table(recorded)) if frame.medium == "bus" and frame.sender == "b"]
    assert [frame.data for frame in again] == [frame.data for frame in original]
    for frame, first in zip(again, original, strict=True):
        assert abs(frame.offered_ns - first.seen_ns) <= (1 if kind in ("blf", "csv") else 500)


def test_a_log_since_1970_of_two_channels(tmp_path: Path) -> None:
    lines = [f"({1_700_000_000 + k * 0.01:.6f}) can{k % 2} 1{k:02X}#{k:02X}" for k in range(10)]
    (tmp_path / "drive.log").write_text("\n".join(lines))
    bus = {"bus": {"kind": "can", "bit_rate_bps": 500_000}}

    with pytest.raises(marconet.ScenarioError, match="set from_first = true to play the log from its first frame"):
        scenario_of(tmp_path, CAN_LOG, media=bus, file="drive.log", channels=["can1"])
    again = play(tmp_path, CAN_LOG, media=bus, file="drive.log", channels=["can1"], from_first=True, offset_ms=5)

    assert [unpack(frame.data).data for frame in again] == [bytes([k]) for k in range(1, 10, 2)]
    for number, frame in enumerate(again):              # a float of seconds since 1970 is within 0.24 us
        assert abs(frame.offered_ns - (5_000_000 + 20_000_000 * number)) <= 1000


def test_a_tlog_plays_one_vehicle(tmp_path: Path) -> None:
    frames = [build(layout_of("HEARTBEAT"), pack(message("HEARTBEAT", type=2)), k, 1 + k % 2, 1) for k in range(20)]
    times_us = [1_700_000_000_000_000 + 5_000 * k for k in range(20)]
    (tmp_path / "flight.tlog").write_bytes(b"".join(
        struct.pack(">Q", time_us) + data for time_us, data in zip(times_us, frames, strict=True)))

    again = play(tmp_path, TLOG, file="flight.tlog", systems=[2], from_first=True)

    assert [(frame.on_air_ns, frame.data) for frame in again] == [
        (10_000_000 * k, data) for k, data in enumerate(frames[1::2])]


def test_a_tlog_of_a_run_is_on_the_air_again(tmp_path: Path) -> None:
    (tmp_path / "flight.tlog").write_bytes(b"".join(
        struct.pack(">Q", 1000 + 5_000 * k) + build(layout_of("HEARTBEAT"), pack(message("HEARTBEAT")), k, 1, 1)
        for k in range(20)))
    first = play(tmp_path, TLOG, file="flight.tlog")
    sent, = [path for path in export_frames(tmp_path / "again", "tlog", None, tmp_path / "logs") if "sent" in path.name]

    again = play(tmp_path, TLOG, file=str(sent))

    assert on_air(again, "radio") == on_air(first, "radio")
    assert sent.read_bytes() == (tmp_path / "flight.tlog").read_bytes()


@pytest.mark.parametrize(("program", "parameters", "told"), [
    (CAPTURE, {"file": "none.pcapng"}, "agents.p.parameters.file="),
    (CAPTURE, {"file": "empty"}, "holds no frame to play"),
    (CAPTURE, {"file": "garbage"}, "no section header at its start: expected a capture in the pcapng format"),
    (CAPTURE, {"file": "frames.pcapng"}, 'choose one, as interface = "..."'),
    (CAPTURE, {"file": "frames.pcapng", "interface": "rodio"}, "interface=rodio: not in"),
    (CAPTURE, {"file": "frames.pcapng", "interface": "radio", "senders": ["z"]}, "senders=z: not in"),
    (CAPTURE, {"file": "frames.pcapng", "interface": "bus"}, "radio is no CAN bus; name a port that fits"),
    (CAPTURE, {"file": "frames.pcapng", "interface": "radio", "port": "bus"}, "port=bus: expected one of the media"),
    (CAPTURE, {"file": "frames.pcapng", "interface": "radio", "offset_s": -1}, "before the start: raise offset_ns"),
    (CAPTURE, {"file": "frames.pcapng", "interface": "radio", "loop_every_ms": 3}, "expected more than the"),
    (CAN_LOG, {"file": "frames.pcapng"}, "whose name ends in one of .log, .blf, .asc, .trc, .csv"),
    (CAN_LOG, {"file": "bus.log", "channels": ["x"]}, "channels=x: not in"),
    (CAN_LOG, {"file": "bus.log", "identifiers": [-1]}, "identifiers=-1: expected 0 to 0x1fffffff"),
    (CAN_LOG, {"file": "bus.log"}, "bus.log holds CAN frames, and radio is no CAN bus"),
    (TLOG, {"file": "garbage"}, "expected a time and a MAVLink frame"),
    (TLOG, {"file": "empty"}, "holds no frame to play")])
def test_what_cannot_be_played_is_an_error_of_one_line_before_the_run(
        recorded: Path, tmp_path: Path, program: str, parameters: dict[str, Any], told: str) -> None:
    for name in ("frames.pcapng", "bus.log"):
        (tmp_path / name).write_bytes((recorded / name).read_bytes())
    (tmp_path / "empty").write_bytes(b"")
    (tmp_path / "garbage").write_bytes(bytes(range(256)) * 4)

    with pytest.raises(marconet.ScenarioError) as error:
        scenario_of(tmp_path, program, **parameters)

    line, = error.value.problems
    assert line.startswith("again.toml: agents.p.parameters")
    assert told in line


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "huge.tlog").open("wb") as file:
        file.truncate(300 << 20)

    with pytest.raises(marconet.ScenarioError, match="314572800 bytes, at most 268435456: cut it into parts"):
        scenario_of(tmp_path, TLOG, file="huge.tlog")
