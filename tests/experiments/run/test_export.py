"""Files of recorders, during the run and afterwards: the same bytes; what cannot be made says why, and what to do."""

from __future__ import annotations

import os
import re
import resource
import signal
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner

import marconet
from experiments.run.export import export_frames
from marconet.command_line import app
from netem.records.frames_file import frame_table, frames_of
from netem.records.ledger_file import read_ledger, read_metadata
from netem.records.pcapng_file import read_packets
from netem.records.table import FROM_FRAMES
from tests.experiments.run.recorded_team import EVERY_LOG, TABLES, team, written_team
from tests.experiments.run.test_records_survive import MARCONET, children, start, under_way, wait_for
from tests.netem.records.capture import fields, needs_tshark

CAN_FILES = ["bus.asc", "bus.blf", "bus.csv", "bus.log", "bus.trc"]
EVERY_RUN = {"scenario.json", "ledger.parquet", "ledger_events.parquet", "signals.mcap", "run.json", "summary.json",
             "report.html"}


def command(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, list(words))
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    found = marconet.run(team(folder, record=["frames", "pcapng"]), host="inline", out=folder / "run", report=True)
    return found.folder


def test_kept_frames_are_those_of_the_ledger_with_their_bytes(run: Path) -> None:
    kept = list(frames_of(frame_table(run)))

    ledger = read_ledger(run / "ledger.parquet").to_pylist()
    rows = {(row["medium"], row["sender"], row["number"]): row for row in ledger if row["on_air_ns"] >= 0}
    assert {frame.medium for frame in kept} == {"radio", "bus", "line"}
    assert len(kept) == len(rows) > 150
    for frame in kept:
        row = rows[frame[:3]]
        assert (frame.offered_ns, frame.on_air_ns, frame.end_ns, len(frame.data)) == (
            row["offered_ns"], row["on_air_ns"], row["end_ns"], row["size_bytes"])


def test_recording_frames_changes_nothing_else(run: Path, tmp_path: Path) -> None:
    without = marconet.run(team(tmp_path), host="inline", out=tmp_path / "run")
    with_processes = marconet.run(team(tmp_path, record="frames"), host="process", out=tmp_path / "processes")

    assert without.ledger_hash == with_processes.ledger_hash == read_metadata(run / "ledger.parquet")["hash"]
    assert not (tmp_path / "run" / "frames.parquet").exists()
    assert (tmp_path / "processes" / "frames.parquet").read_bytes() == (run / "frames.parquet").read_bytes()


@pytest.mark.parametrize("kind", ["pcapng", *EVERY_LOG])
def test_what_is_exported_is_what_the_run_wrote_byte_for_byte(run: Path, tmp_path: Path, kind: str) -> None:
    code, told = command("export", str(run), "--as", kind, "--out", str(tmp_path))

    files = sorted(path.name for path in tmp_path.iterdir())
    assert (code, told.splitlines()) == (0, [f"{kind}: {tmp_path / name}" for name in files])
    assert files == (["frames.pcapng", "marconet.lua"] if kind == "pcapng"
                     else ["bus." + {"candump": "log"}.get(kind, kind)])
    for name in files:
        assert (tmp_path / name).read_bytes() == (run / name).read_bytes()


def test_each_packet_has_the_fates_of_its_copies(run: Path) -> None:
    packets = list(read_packets(run / "frames.pcapng"))

    times = [packet.time_ns for packet in packets]
    assert times == sorted(times)
    fates: dict[tuple[str, ...], set[str]] = {}
    for row in read_ledger(run / "ledger.parquet").to_pylist():
        name = row["receiver"] + (f" copy {row['copy']}" if row["copy"] else "")
        at = f" at {row['delivered_ns']} ns" if row["delivered_ns"] >= 0 else ""
        cause = f" ({row['cause']})" if row["cause"] else ""
        key = row["medium"], row["sender"], str(row["number"])
        fates.setdefault(key, set()).add(f"{name}: {row['fate']}{at}{cause}")
    told = {}
    for packet in packets:
        head, *copies = packet.comment.split(" | ")
        found = dict(word.split("=") for word in head.split())
        assert int(found["on_air_ns"]) == packet.time_ns
        told[packet.interface, found["sender"], found["number"]] = set(copies)
    assert told == {key: fates[key] for key in told}
    words = " ".join(packet.comment for packet in packets)
    assert all(word in words for word in ("lost (impairments[0] bernoulli_loss)", "copy 1: delivered at", "unfinished"))


@needs_tshark
def test_wireshark_finds_a_lost_frame_by_a_filter(run: Path) -> None:
    rows = fields(run / "frames.pcapng", "marconet.sender", "marconet.medium", where='marconet.fate == "lost"')

    lost = [row for row in read_ledger(run / "ledger.parquet").to_pylist() if row["fate"] == "lost"]
    assert rows == [["a", "radio"]] * len(lost) != []


def test_slots_are_numbered_if_their_length_is_given(tmp_path: Path) -> None:
    scenario = team(tmp_path, records={"pcapng": {"media": ["radio"], "slot_ms": 5}})

    folder = marconet.run(scenario, host="inline", out=tmp_path / "run").folder

    found = list(read_packets(folder / "frames.pcapng"))
    assert {packet.interface for packet in found} == {"radio"}
    assert [int(re.findall(r" slot=(\d+) ", packet.comment)[0]) for packet in found] == [
        packet.time_ns // 5_000_000 for packet in found]
    assert export_frames(folder, "pcapng", None, tmp_path / "again")[0].read_bytes() == (
        folder / "frames.pcapng").read_bytes()


def test_one_medium_alone(run: Path, tmp_path: Path) -> None:
    assert command("export", str(run), "--as", "pcapng", "--medium", "bus", "--out", str(tmp_path))[0] == 0

    packets = read_packets(tmp_path / "frames.pcapng")
    assert {(packet.interface, packet.link_type) for packet in packets} == {("bus", 227)}


@pytest.mark.parametrize(("words", "told"), [
    (["--as", "tlog", "--medium", "bus"], "bus: bus is a CAN bus, which carries no MAVLink; name one of radio, line"),
    (["--as", "blf", "--medium", "radio"],
     "radio: a log of CAN frames is of a CAN bus, which radio is not; the CAN buses are bus"),
    (["--as", "blf", "--medium", "bis"], '--medium bis: the run has no such medium; did you mean "bus"?'),
    (["--as", "tlog"], "no frame holds what tlog records; the run kept"),
    (["--as", "tlog", "--medium", "line"], "no frame of line holds what tlog records; the run kept")])
def test_a_medium_without_this_format_is_an_error_of_one_line(run: Path, tmp_path: Path, words: list[str], told: str
                                                              ) -> None:
    code, output = command("export", str(run), *words, "--out", str(tmp_path))

    assert code == 2
    assert told in output
    assert output.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", FROM_FRAMES)
def test_a_run_that_kept_no_frames_says_how_to_keep_them(tmp_path: Path, kind: str) -> None:
    media = {**TABLES["media"], "bus": {"kind": "can", "bit_rate_bps": 500_000}}
    out = marconet.run(team(tmp_path, media=media), host="inline", out=tmp_path / "run").folder

    code, output = command("export", str(out), "--as", kind)

    assert (code, output) == (2, f'{out}: the run kept no bytes of its frames: write `record = "frames"` at the top of '
                                 "its scenario, before its tables, and run it again\n")


def test_a_word_that_is_no_recorder_is_refused(tmp_path: Path) -> None:
    for named, told in (("frame", '"frame": no such recorder; did you mean "frames"?'),
                        (["frames", "pcap"], '"pcap": no such recorder; did you mean "pcapng"?')):
        with pytest.raises(marconet.ScenarioError) as error:
            team(tmp_path, record=named)
        assert error.value.problems == [f"team.toml: record={told}"]


def test_a_new_run_removes_the_files_of_the_last(tmp_path: Path) -> None:
    marconet.run(team(tmp_path, record=["frames", "pcapng"]), host="inline", out=tmp_path / "run")
    plain = {**TABLES["media"], "bus": {"kind": "can", "bit_rate_bps": 500_000}}

    marconet.run(team(tmp_path, media=plain), host="inline", out=tmp_path / "run", overwrite=True)

    assert {path.name for path in (tmp_path / "run").iterdir()} <= EVERY_RUN


@pytest.mark.slow
@pytest.mark.parametrize("host", ["process", "inline"])
def test_after_a_kill_frames_and_capture_are_made_of_what_is_on_the_disk(tmp_path: Path, host: str) -> None:
    forever = written_team(tmp_path, record=["frames", "pcapng"], length_s=100_000.0)
    out = tmp_path / "run"
    with start(forever, out, "--host", host) as running:
        wait_for(lambda: running.poll() is not None or kept_bytes(out) > 20_000)
        emulator = running.pid if host == "process" else children(running.pid)[0]
        os.kill(emulator, signal.SIGKILL)
        running.communicate(timeout=120)
    if host == "process":
        done = subprocess.run([*MARCONET, "report", str(out)], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")

    kept = list(frames_of(frame_table(out)))
    assert {path.name for path in out.glob("frames*")} == {"frames.parquet", "frames.pcapng"}
    assert len(list(read_packets(out / "frames.pcapng"))) == len(kept) > 100
    on_air = {(row["medium"], row["sender"], row["number"]) for row in read_ledger(out / "ledger.parquet").to_pylist()
              if row["on_air_ns"] >= 0 and row["delivered_ns"] >= 0}
    missing = on_air - {frame[:3] for frame in kept}
    assert len(missing) <= 0.05 * len(on_air)       # the journals are written one after the other
    assert command("export", str(out), "--as", "candump", "--out", str(tmp_path / "log"))[0] == 0


@pytest.mark.slow
def test_on_a_full_disk_the_frames_so_far_stay_readable(tmp_path: Path) -> None:
    forever = written_team(tmp_path, record=["frames", "pcapng"], length_s=100_000.0)
    out = tmp_path / "run"
    with start(forever, out, "--host", "process", "--no-report") as running:
        wait_for(lambda: running.poll() is not None or kept_bytes(out) > 20_000)
        fullest = max(file.stat().st_size for file in out.glob("*.part"))       # a file grows no further
        resource.prlimit(running.pid, resource.RLIMIT_FSIZE, (fullest, fullest))
        _, told = running.communicate(timeout=120)

    assert running.returncode == 2, told
    assert f"{out}: cannot write the records: File too large: free space" in told
    frames_before = len(list(frames_of(frame_table(out))))
    assert frames_before > 100
    assert command("report", str(out))[0] == 0          # there is room again
    assert len(list(frames_of(frame_table(out)))) >= frames_before
    assert not list(out.glob("frames*.part"))


def kept_bytes(out: Path) -> int:
    """The size of the journal of frames, 0 before the run is under way."""
    return (out / "frames.rows.part").stat().st_size if under_way(out) else 0
