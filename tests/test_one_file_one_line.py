"""A new member of a kind is one file (here in tests/members) and one line in its table; no other code knows of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import marconet
from netem.impairments.table import IMPAIRMENTS
from netem.media.table import MEDIA
from netem.records.table import RECORDERS
from tests.members.every_second import EverySecond

PROGRAM = '''
class Talker:
    def __init__(self, board):
        self.board, self.ring = board, board.port("ring", lambda data: board.count("heard"), listen_only=True)

    def run(self):
        for k in range(10):
            yield from self.board.sleep_until(k * 10_000_000)
            self.ring.send(b"four")
'''
TABLES: dict[str, Any] = {
    "seed": 7, "length_s": 0.2, "agents_defaults": {"program": "talker:Talker"}, "agents": {"a": {}, "b": {}, "c": {}},
    "media": {"ring": {"kind": "ring", "latency_ms": 2}},
    "guarantees": {"fresh": {"kind": "age_of_information", "on": "ring: * -> *", "below_s": 1.0}},
    "expect": {"count.ring.frames": {"min": 30, "max": 30}}}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setitem(MEDIA._paths, "ring", "tests.members.ring:Ring")
    monkeypatch.setitem(RECORDERS._paths, "ring_log", "tests.members.ring:RingLog")
    monkeypatch.setitem(IMPAIRMENTS, "every_second", EverySecond)
    (tmp_path / "talker.py").write_text(PROGRAM)
    return tmp_path


def test_a_new_medium_is_carried_counted_recorded_and_logged(folder: Path) -> None:
    scenario = marconet.Scenario("ring", folder=folder, **TABLES)

    run = marconet.run(scenario, host="inline", out=folder / "run", report=True)

    assert run.holds, run.first_violation()
    assert run.counters["b"]["heard"] == 10
    assert run.signals["ring"]["bytes"].to_list() == [4.0] * 30
    assert run.events.filter(kind="handed on").height == 30
    assert (folder / "run" / "ring.txt").read_text().splitlines()[0] == "0 a four"
    assert "ring" in run.report().read_text()


def test_a_new_medium_says_which_links_it_has(folder: Path) -> None:
    scenario = marconet.Scenario("ring", folder=folder, **TABLES)

    with pytest.raises(marconet.ScenarioError, match="no such link at any time of the run"):
        marconet.Scenario("ring", folder=folder, **TABLES | {"guarantees": {
            "fresh": {**TABLES["guarantees"]["fresh"], "on": "ring: a -> c"}}})

    assert scenario.checked.guarantees["fresh"].subjects == (("ring", "a", "b"), ("ring", "b", "c"), ("ring", "c", "a"))


def test_a_new_impairment_acts_on_a_link(folder: Path) -> None:
    scenario = marconet.Scenario("ring", folder=folder, **TABLES, impairments=[
        {"kind": "every_second", "on": "ring: a -> b", "first": 1}])

    run = marconet.run(scenario, host="inline", out=folder / "run")

    assert run.counters["b"]["heard"] == 5
    assert set(run.ledger.filter(fate="lost")["cause"]) == {"impairments[0] every_second"}
