"""A node that is killed while the run goes on: what reaches it before is delivered, at or after it RECEIVER_GONE."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pytest

from experiments.run import runner
from experiments.scenario import load
from netem.core.agenda import TIMER
from netem.core.fate import Fate
from netem.records.ledger_file import hash_of, read_ledger, read_metadata
from netem.wire.instants import NEVER_NS

MS = 1_000_000
RUN = runner._Run
PROGRAM = '''
from dataclasses import dataclass

from netem.media.can.frame import CanFrame, pack

class Beacon:
    @dataclass
    class Settings:
        offset_ns: int
        identifier: int

    def __init__(self, board, settings):
        self.frame = pack(CanFrame(settings.identifier, bytes(8)))
        self.radio, self.bus = (board.port(name, lambda frame: board.count("heard"), listen_only=True)
                                for name in ("radio", "bus"))
        board.record("time", "s", lambda: board.now_ns * 1e-9)
        board.every(10_000_000, self.say, offset_ns=settings.offset_ns)

    def say(self):
        self.radio.send(bytes(8))
        self.bus.send(self.frame)
'''
SCENARIO = '''
# Question: what becomes of copies to a node that is gone?
seed = 7
length_s = 0.2
[agents_defaults]
program = "beacon:Beacon"
[agents]
a = { parameters = { offset_ms = 0, identifier = 1 } }
b = { parameters = { offset_ms = 3, identifier = 2 } }
c = { parameters = { offset_ms = 6, identifier = 3 } }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p", receive_latency_us = 300 }
bus = { kind = "can", bit_rate_bps = 500_000 }
[[impairments]]
on = "radio: c -> b"
kind = "delay"
delay_ms = 35
'''
Row = dict[str, Any]


def run_it(folder: Path, host: Any, *deaths: tuple[int, str, int], monkeypatch: pytest.MonkeyPatch) -> list[Row]:
    """The ledger's rows. `deaths`: when it is said, of whom, and from when on."""
    class WithDeaths(RUN):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            for said_ns, name, from_ns in deaths:
                self.agenda.at(said_ns, TIMER, "", partial(self.conductor.stop_at, from_ns, partial(
                    self.conductor.kill, name, NEVER_NS, {})))

    monkeypatch.setattr(runner, "_Run", WithDeaths)
    folder.mkdir()
    (folder / "beacon.py").write_text(PROGRAM)
    (folder / "gone.toml").write_text(SCENARIO)
    runner.run(load(folder / "gone.toml"), host=host, out=folder / "run", report=False)     # checks conservation
    ledger = folder / "run" / "ledger.parquet"
    assert read_metadata(ledger)["hash"] == hash_of(ledger)
    return read_ledger(ledger).to_pylist()


def of(row: Row) -> tuple[Any, ...]:
    return row["medium"], row["sender"], row["number"], row["receiver"]


def heard(folder: Path) -> dict[str, int]:
    counters = msgspec.json.decode((folder / "run" / "run.json").read_bytes())["counters"]
    return {node: counters[node]["heard"] for node in "abc"}


@pytest.mark.parametrize("medium", ["radio", "bus"])
def test_a_copy_between_decision_and_arrival_at_the_death_is_gone(tmp_path: Path, medium: str,
                                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    alive = run_it(tmp_path / "alive", "inline", monkeypatch=monkeypatch)
    under_way = next(row for row in alive if (row["medium"], row["sender"], row["receiver"]) == (medium, "a", "b")
                     and row["offered_ns"] >= 100 * MS)
    decided_ns = under_way["end_ns"] if medium == "radio" else under_way["on_air_ns"]
    between_ns = (decided_ns + under_way["delivered_ns"]) // 2
    assert decided_ns < between_ns < under_way["delivered_ns"]

    for death_ns in (between_ns, under_way["delivered_ns"], under_way["delivered_ns"] + 1):
        folder = tmp_path / str(death_ns)
        rows = run_it(folder, "inline", (0, "b", death_ns), monkeypatch=monkeypatch)
        again = run_it(tmp_path / f"{death_ns} in processes", "process", (0, "b", death_ns), monkeypatch=monkeypatch)

        assert again == rows
        before = {of(row): row for row in alive}
        for row in rows:
            if (was := before[of(row)])["receiver"] != "b" or was["delivered_ns"] < death_ns:
                assert row == was
            else:
                assert row == was | {"fate": "receiver gone", "delivered_ns": -1, "cause": ""}
        assert [of(row) for row in rows] == [of(row) for row in alive
                                             if row["sender"] != "b" or row["offered_ns"] < death_ns]
        fate = next(row["fate"] for row in rows if of(row) == of(under_way))
        assert fate == ("delivered" if death_ns > under_way["delivered_ns"] else "receiver gone")
        assert heard(folder) == {node: sum(row["receiver"] == node and row["fate"] == "delivered" for row in rows)
                                 for node in "abc"} == heard(tmp_path / f"{death_ns} in processes")


def test_copies_decided_before_anybody_knows_of_the_death_are_corrected(tmp_path: Path,
                                                                         monkeypatch: pytest.MonkeyPatch) -> None:
    known = run_it(tmp_path / "known", "inline", (0, "b", 100 * MS), monkeypatch=monkeypatch)
    said_late = run_it(tmp_path / "late", "inline", (90 * MS, "b", 100 * MS), monkeypatch=monkeypatch)

    assert said_late == known
    decided_before = [row for row in said_late if (row["medium"], row["sender"], row["receiver"]) == ("radio", "c", "b")
                      and 65 * MS <= row["end_ns"] < 90 * MS]
    assert {row["fate"] for row in decided_before} == {Fate.RECEIVER_GONE.value}
    assert len(decided_before) == 3


def test_every_node_may_go_and_the_run_ends_at_its_length(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = run_it(tmp_path / "all", "inline", *((0, name, 50 * MS) for name in "abc"), monkeypatch=monkeypatch)

    assert max(row["offered_ns"] for row in rows) < 50 * MS
    assert {row["fate"] for row in rows} == {"delivered", "receiver gone"}
    assert msgspec.json.decode((tmp_path / "all" / "run" / "run.json").read_bytes())["reached_ns"] == 200 * MS


def test_nobody_is_gone_in_the_past(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="nothing can happen at 50000000 ns any more: the run is at "):
        run_it(tmp_path / "past", "inline", (100 * MS, "b", 50 * MS), monkeypatch=monkeypatch)
