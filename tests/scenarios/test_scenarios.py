"""Every scenario in scenarios/ is a test: it runs in full, and what it expects holds."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import load
from experiments.scenario.blocking_programs import blocks

FOLDER = Path(__file__).parents[2] / "scenarios"
HASHES: dict[str, str] = tomllib.loads(Path(__file__).with_name("ledger_hashes.toml").read_text())
# More than 1.8 s of processor time each, and another of its kind is quicker.
SLOW = {"faults_output_sync", "faults_pursuit", "faults_tracking", "four_sensors_two_targets",
        "free_pursuer_chases_runner_broken", "hummingbird_chases_rovio", "hummingbird_chases_rovio_broken",
        "marco_polo_adaptive", "marco_polo_faults", "marco_polo_platforms", "marco_polo_zone", "output_sync_16",
        "output_sync_delayed", "output_sync_drift", "output_sync_firmware", "output_sync_formation",
        "output_sync_model_holds", "output_sync_observers", "output_sync_reference",
        "output_sync_reference_disturbed", "p3at_chases_p3at_broken", "p3at_chases_runner", "tracking_busload",
        "tracking_delayed", "tracking_event_triggered", "tracking_lossy", "tracking_optimal", "tracking_optimal_can",
        "tracking_p3at", "tracking_p3at_too_fast", "tracking_predicted", "tracking_unified", "two_p3at_chase_rovio",
        "two_p3at_chase_rovio_broken"}
SCENARIOS = [pytest.param(path, id=path.stem) for path in sorted(FOLDER.glob("*.toml"))]
IN_FULL = [pytest.param(*each.values, id=each.id, marks=pytest.mark.slow if each.id in SLOW else ())
           for each in SCENARIOS]


def test_none_is_missing() -> None:
    assert len(SCENARIOS) >= 6


@pytest.mark.parametrize("path", IN_FULL)
def test_what_it_expects_holds_and_its_ledger_is_the_recorded_one(path: Path, tmp_path: Path) -> None:
    scenario = load(path)
    if scenario.gateways:           # somebody outside is waited for; here nobody comes
        nowhere = [f"gateways.{name}.listen='127.0.0.1:0'" for name in scenario.gateways]
        scenario = load(path, duration_s=2.0, overrides=nowhere)

    hosts: tuple[HostName, ...] = ("inline", "process") if blocks(scenario) else ("inline",)
    for host in hosts:
        summary = run(scenario, host=host, out=tmp_path / host, report=False,
                      real_time=bool(scenario.gateways)).summary

        assert [f"{verdict.key}={verdict.value}: {verdict.by_how_much()}" for verdict in summary.verdicts
                if not verdict.holds] == []
        if not scenario.gateways:
            assert summary.ledger_hash == HASHES[path.stem]


@pytest.mark.parametrize("path", SCENARIOS)
def test_it_asks_one_question_and_expects_something(path: Path) -> None:
    scenario = load(path)

    assert scenario.question.count("?") == 1
    assert scenario.expect
