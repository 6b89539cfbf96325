"""The faults of `marco_polo_faults`: each formula fails if its fault, or the bound that it states, is another."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.run.runner import run
from experiments.scenario import find, load

SENSORS = ("uav_1", "uav_2", "ugv_1", "ugv_2", "ugv_3", "ugv_4", "ugv_5")
BLIND, PARTED, DEATH, CORNER = (f"faults[{index}]" for index in range(4))


def broken(folder: Path, *overrides: str) -> set[str]:
    summary = run(load(find("marco_polo_faults"), overrides=overrides), host="inline", out=folder, report=False).summary
    return {verdict.key for verdict in summary.verdicts if not verdict.holds}


@pytest.mark.parametrize(("overrides", "key"), [
    ((f"{BLIND}.during_s=[1.0, 1.1]",), "blind"),
    ((f"{BLIND}.during_s=[14.5, 15.4]",), "sees_again"),
    ((f"{PARTED}.during_s=[1.0, 1.1]",), "two_in_the_partition"),
    ((f"{PARTED}.during_s=[15.56, 17.9]",), "one_after_it"),
    pytest.param((f"{DEATH}.on='ugv_*'",), "taken_over", marks=pytest.mark.slow),   # nobody is left
    pytest.param(tuple(f"agents.{name}.parameters.heartbeat_rounds=8" for name in SENSORS), "taken_over",
                 marks=pytest.mark.slow),
    (("expect.taken_over='always[20.225 s, 23 s] pursuers.target_1 > 0.5'",), "taken_over"),      # half of the bound
    ((f"{CORNER}.during_s=[1.0, 2.5]",), "two_in_the_jam"),
    pytest.param((f"{CORNER}.zone.high_m=[10.0, 1.0]",), "two_in_the_jam", marks=pytest.mark.slow),     # without ugv_2
    pytest.param((f"{CORNER}.during_s=[21.0, 22.9]",), "one_after_the_jam", marks=pytest.mark.slow),
    (("expect.one_after_the_jam='always[22.535 s, 30 s] pursuers.target_1 < 1.5'",), "one_after_the_jam"),   # 35 ms
])
def test_another_fault_or_bound_breaks_its_formula(overrides: tuple[str, ...], key: str, tmp_path: Path) -> None:
    assert key in broken(tmp_path / "run", *overrides)


@pytest.mark.slow
def test_both_hosts_have_one_ledger_while_sensors_die(tmp_path: Path) -> None:
    scenario = load(find("marco_polo_faults"), duration_s=21.5, overrides=["expect={}"])

    inline = run(scenario, host="inline", out=tmp_path / "inline", report=False).summary
    process = run(scenario, host="process", out=tmp_path / "process", report=False).summary

    assert inline.ledger_hash == process.ledger_hash
