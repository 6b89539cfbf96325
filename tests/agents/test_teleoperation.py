"""Streams over a packet network, in runs on both hosts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import marconet
from agents.teleoperation.stream import StreamSettings
from experiments.run.runner import run
from experiments.scenario import find, load

SLOW = 'media.lan.links."robot <-> operator".rate_bps=2_400_000'


def test_both_hosts_leave_the_same_ledger(tmp_path: Path) -> None:
    scenario = load(find("camera_on_the_uplink"), duration_s=2.0, overrides=["expect={}"])

    hashes = {host: run(scenario, host=host, out=tmp_path / host, report=False).summary.ledger_hash
              for host in ("inline", "process")}

    assert hashes["inline"] == hashes["process"]


def test_an_uplink_that_is_too_slow_for_the_images_makes_the_status_old(tmp_path: Path) -> None:
    scenario = load(find("camera_on_the_uplink"), duration_s=5.0, overrides=[SLOW])

    summary = run(scenario, host="inline", out=tmp_path, report=False).summary

    assert [verdict.key for verdict in summary.verdicts if not verdict.holds and "guarantee" in verdict.key] == [
        "guarantee.fresh.violations"]


def test_receivers_learn_the_source_and_count_by_it(tmp_path: Path) -> None:
    tables: dict[str, Any] = {
        "seed": 1, "length_s": 1.0, "agents_defaults": {"program": "agents.teleoperation.stream:Stream", "parameters": {
            "size_bytes": 10, "period_ms": 100}},
        "agents": {"a": {"parameters": {"destination": "*"}}, "b": {"parameters": {"destination": "a"}},
                   "c": {"parameters": {"destination": "a"}}},
        "media": {"lan": {"kind": "packet_network", "rate_bps": 1_000_000}}}

    counters = marconet.run(marconet.Scenario("three", **tables), host="inline", out=tmp_path / "run").counters

    assert {name: counters[name]["datagrams heard"] for name in "abc"} == {"a": 20, "b": 10, "c": 10}
    assert counters["a"]["datagrams out of order"] == 0
    assert counters["lan"]["a -> b packets sent"] == 10


@pytest.mark.parametrize(("keys", "message"), [
    ({"size_bytes": 3, "period_ns": 1}, "size_bytes=3: expected at least 4"),
    ({"size_bytes": 4, "period_ns": 0}, "expected a period of at least 1 ns")])
def test_settings_that_do_not_fit_are_refused(keys: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        StreamSettings("a", **keys)
