"""A convoy that waits for its slowest vehicle, and one that loses it at the computed instants."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import find, load
from netem.records.ledger_file import read_ledger

RANGE_M = 100.0             # 0 dBm - 40 dB - 20 dB log10(100) = -80 dBm
SPEED_LOST_MPS = 2.0 - 1.2


def ran(folder: Path, *changes: str) -> tuple[Any, list[dict[str, Any]]]:
    run(load(find("convoy_out_of_range"), overrides=changes), host="inline", out=folder, report=False)
    return load_run(folder), read_ledger(folder / "ledger.parquet").to_pylist()


def test_a_leader_that_waits_settles_at_the_speed_and_the_distance_of_the_slowest(tmp_path: Path) -> None:
    data, rows = ran(tmp_path)

    assert {row["fate"] for row in rows} == {"delivered"}
    v1, v4 = data.signals["v1"], data.signals["v4"]
    assert v1.column("speed_command")[-1] == pytest.approx(1.2, abs=1e-3)
    # cruise + gain (allowed - behind) = slowest, and the last position heard is up to a period and 60 ms old
    behind_m = 60.0 + (2.0 - 1.2) / 0.5
    assert v1.column("x")[-1] - v4.column("x")[-1] == pytest.approx(behind_m, abs=1.2 * 0.16 + 0.01)


def test_a_leader_that_does_not_wait_loses_the_slowest_when_the_distance_is_the_range(tmp_path: Path) -> None:
    data, rows = ran(tmp_path, "agents_defaults.parameters.waits=false")

    first_s = {pair: min(row["offered_ns"] for row in rows if (row["sender"], row["receiver"]) == pair
                         and row["fate"] == "too weak") / 1e9 for pair in (("v4", "v1"), ("v3", "v4"))}
    # v4 starts 0.2 s late at most, as the vehicles ahead are heard first; frames come every 0.1 s
    assert first_s["v4", "v1"] == pytest.approx((RANGE_M - 30.0) / SPEED_LOST_MPS, abs=0.3)
    assert first_s["v3", "v4"] == pytest.approx((RANGE_M - 10.0) / SPEED_LOST_MPS, abs=0.3)
    assert data.counters["v4"]["stops"] == 1
    stopped, = [event for event in data.events if event.kind == "stopped"]
    assert stopped.time_ns / 1e9 - first_s["v3", "v4"] == pytest.approx(0.5, abs=0.1)      # hold_ns, and a period
