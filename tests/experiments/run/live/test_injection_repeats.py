"""What a page injects at any instant of a run in virtual time, the run repeats: cases that a script hits exactly."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.experiments.run.live.steered_bench import SteeredView, hashes, repeated, steered
from tests.experiments.run.live.view_bench import scenario_in

MS = 1_000_000


@pytest.mark.parametrize("kind", ["link_down", "partition", "undetected_corruption"])
def test_a_fault_of_a_link_spares_a_copy_that_waits_for_its_receive_latency(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    scenario = scenario_in(tmp_path, 0.1)
    on = {"on": "radio", "shape": "halves"} if kind == "partition" else {"on": "radio: a -> c"}

    def script(view: SteeredView) -> None:
        if view.now_ns == 10 * MS + 200_000 and not view.answers:       # the frame of `a` ends at 10.0765 ms,
            view.fault(kind, lasts_s="0.02", **on)                      # and reaches programs 0.3 ms after its end

    view = steered(scenario, tmp_path / "run", script, monkeypatch, stop_every_ns=200_000)

    assert [answer.error for answer in view.answers] == [""]
    assert repeated(scenario, tmp_path / "run", tmp_path / "again") == hashes(tmp_path / "run")
