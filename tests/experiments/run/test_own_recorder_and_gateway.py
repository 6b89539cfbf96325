"""A recorder and a gateway are one file and one line each: here a class of the test and an entry of the table."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any, ClassVar

import pytest

from experiments.run.run_folder import clear
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from netem.core.frame import Frame
from netem.gateways import Gateway, GatewaySettings
from netem.gateways.table import GATEWAYS
from netem.gateways.udp import UdpGateway
from netem.records import Feed, Place, Recorder
from netem.records.ledger import COLUMNS, Row
from netem.records.ledger_file import read_ledger
from netem.records.table import RECORDERS

PROGRAM = '''
from dataclasses import dataclass

from netem.media.can.frame import CanFrame, pack

class Beacon:
    @dataclass
    class Settings:
        number: int

    def __init__(self, board, settings):
        self.board, self.number, self.k = board, settings.number, 0
        self.ports = {name: board.port(name) for name in board.ports}
        board.record("time", "s", lambda: board.now_ns * 1e-9)
        board.every(10_000_000, self.say, offset_ns=1_000_000 * settings.number)

    def say(self):
        self.ports["radio"].send(bytes([self.number, self.k]) * 4)
        self.ports["bus"].send(pack(CanFrame(self.number, bytes([self.k]))))
        if "line" in self.ports:
            self.ports["line"].send(b"serial")
        self.board.event("spoke", str(self.k))
        self.k += 1
'''
SCENARIO = '''
# Question: who gets every frame?
seed = 1
length_s = 0.1
[agents_defaults]
program = "beacon:Beacon"
[agents]
a = { parameters = { number = 1 }, media = ["radio", "bus", "line"] }
b = { parameters = { number = 2 }, media = ["radio", "bus", "line"] }
c = { parameters = { number = 3 }, media = ["radio", "bus"] }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p" }
bus = { kind = "can", bit_rate_bps = 500_000 }
line = { kind = "serial_line", baud_bps = 115_200 }
'''


@dataclass(frozen=True)
class RawSettings:
    media: tuple[str, ...] = ()


class RawFrames(Recorder):
    """Every frame on the air of `media`, and what else happens, as lines of JSON."""

    Settings = RawSettings
    FILES = ("raw.jsonl",)

    def __init__(self, settings: RawSettings, place: Place) -> None:
        super().__init__(settings, place)
        self._file = (place.folder / "raw.jsonl").open("w")

    def record(self, run: Feed) -> None:
        for medium in self.settings.media:
            run.frames[medium].append(self)
        run.copies.append(lambda rows: [self._write("copy", *row) for row in rows] and None)
        run.samples.append(lambda node, time_ns, values: self._write("sample", node, time_ns, *values))
        run.events.append(lambda event: self._write("event", event.node, event.time_ns, event.kind))

    def frame(self, frame: Frame, seen_ns: int) -> None:
        self._write("frame", frame.medium, frame.sender, frame.number, frame.on_air_ns, frame.end_ns, frame.data,
                    seen_ns)

    def error_frame(self, medium: str, time_ns: int) -> None:
        self._write("error frame", medium, time_ns)

    def finish(self) -> None:
        self._file.close()

    def _write(self, what: str, *values: Any) -> None:
        self._file.write(json.dumps([what, *(value.hex() if isinstance(value, bytes) else value for value in values)])
                         + "\n")


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    (tmp_path / "beacon.py").write_text(PROGRAM)
    (tmp_path / "raw.toml").write_text(SCENARIO)
    return tmp_path / "raw.toml"


@pytest.fixture
def with_raw_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(RECORDERS._paths, "raw_frames", f"{__name__}:RawFrames")


@pytest.mark.usefixtures("with_raw_frames")
def test_a_recorder_of_ones_own_gets_all_that_it_asks_for(scenario: Path) -> None:
    without = run(load(scenario), host="inline", out=scenario.parent / "without", report=False)
    scenario.write_text(SCENARIO + '[records.raw_frames]\nmedia = ["radio", "bus", "line"]\n')

    asked = run(load(scenario), host="inline", out=scenario.parent / "with", report=False)

    assert asked.summary.ledger_hash == without.summary.ledger_hash
    assert not (scenario.parent / "without" / "raw.jsonl").exists()
    lines = [json.loads(line) for line in (scenario.parent / "with" / "raw.jsonl").read_text().splitlines()]
    told: dict[str, list[Any]] = {}
    for what, *values in lines:
        told.setdefault(what, []).append(values)
    ledger = read_ledger(scenario.parent / "with" / "ledger.parquet").to_pylist()
    frames = {(row["medium"], row["sender"], row["number"]): row for row in ledger}
    assert {key[0] for key in frames} == {"radio", "bus", "line"}
    assert len(told["frame"]) == len(frames)
    for medium, sender, number, on_air_ns, end_ns, data, seen_ns in told["frame"]:
        row = frames[medium, sender, number]
        assert (row["on_air_ns"], row["end_ns"], row["size_bytes"]) == (on_air_ns, end_ns, len(bytes.fromhex(data)))
        assert row["digest"] == blake2b(bytes.fromhex(data), digest_size=8).digest()
        assert on_air_ns < seen_ns <= end_ns
    assert told["copy"] == [[row[name].hex() if name == "digest" else row[name] for name in COLUMNS] for row in ledger]
    assert len(told["event"]) == 30
    assert sum(node in "abc" for node, *_ in told["sample"]) == 30

    clear(scenario.parent / "with")
    assert not os.listdir(scenario.parent / "with")


@pytest.mark.usefixtures("with_raw_frames")
def test_its_settings_are_checked_before_the_run(scenario: Path) -> None:
    scenario.write_text(SCENARIO + "[records.raw_frames]\nmedium = 1\n[records.raw_frame]\n")

    with pytest.raises(ScenarioError) as error:
        load(scenario)

    assert error.value.problems == [
        'raw.toml: records.raw_frames.medium=1: unknown key; did you mean "media"?',
        "raw.toml: records.raw_frame: no such recorder; did you mean \"raw_frames\"?"]


@dataclass(frozen=True)
class PipeSettings(GatewaySettings):
    greeting: str


class PipeGateway(Gateway):
    """Says `greeting` once, and keeps what it hears."""

    Settings: ClassVar = PipeSettings
    heard: ClassVar[list[bytes]] = []

    def __init__(self, name: str, medium: str, settings: PipeSettings, **others: Any) -> None:
        super().__init__(name, medium, settings, **others)
        self._read, self._write = os.pipe()
        os.write(self._write, settings.greeting.encode())

    def fileno(self) -> int:
        return self._read

    def receive(self, most: int) -> list[bytes]:
        return [os.read(self._read, 100)]

    def send(self, data: bytes) -> None:
        self.heard.append(data)

    def counters(self) -> Mapping[str, int]:
        return {"messages heard": len(self.heard)}

    def close(self) -> None:
        os.close(self._read)
        os.close(self._write)


def test_a_gateway_of_ones_own_stands_on_a_medium(scenario: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(GATEWAYS._paths, "pipe", f"{__name__}:PipeGateway")
    scenario.write_text(SCENARIO + '[gateways.outside]\nkind = "pipe"\nmedium = "radio"\ngreeting = "hello"\n')

    result = run(load(scenario), host="inline", out=scenario.parent / "run", report=False, real_time=True)

    rows: Sequence[Row] = [tuple(row.values()) for row in
                           read_ledger(result.folder / "ledger.parquet").to_pylist()]
    assert {row[3] for row in rows if row[1] == "outside"} == {"a", "b", "c"}
    assert PipeGateway.heard
    counters = json.loads((result.folder / "run.json").read_text())["counters"]
    assert counters["outside"] == {"messages heard": len(PipeGateway.heard)}


def test_a_gateway_that_names_no_kind_is_one_over_udp(scenario: Path) -> None:
    scenario.write_text(SCENARIO + '[gateways.outside]\nmedium = "radio"\n')

    spec = load(scenario).gateways["outside"]

    assert (spec.kind, spec.settings) == ("udp", UdpGateway.Settings("127.0.0.1:0"))
