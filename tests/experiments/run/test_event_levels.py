"""A run records events with the level that they had where they were raised."""

from __future__ import annotations

from pathlib import Path

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import load
from experiments.scenario.library import find
from netem.wire.level import Level


def test_a_run_records_what_broke_as_a_warning_and_the_rest_as_information(tmp_path: Path) -> None:
    late = "media.can.messages.setpoint.deadline_ms=16"             # its jitter alone is that much
    scenario = load(find("tracking_busload"), duration_s=6.5, overrides=["expect={}", late])

    events = load_run(run(scenario, host="inline", out=tmp_path, report=False).folder).events

    levels = {event.kind: event.level for event in events}
    assert levels["assumption violated"] == levels["setpoint stale"] == Level.WARNING       # of nodes
    assert levels["message may be late"] == Level.WARNING                                   # of a medium
    assert levels["gain product"] == levels["drive running"] == Level.INFO
