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


@pytest.mark.parametrize("kind", ["kill", "pause"])
def test_a_fault_at_the_instant_at_which_a_pause_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                      kind: str) -> None:
    scenario = scenario_in(tmp_path, 0.1)

    def script(view: SteeredView) -> None:
        if view.now_ns == 10 * MS and not view.answers:
            view.fault("pause", on="c", lasts_s="0.02", buffer_frames="1")
        elif view.now_ns == 30 * MS and len(view.answers) == 1:
            more = {"restart_after_s": "0.02"} if kind == "kill" else {"lasts_s": "0.02", "buffer_frames": "1"}
            view.fault(kind, on="c", **more)

    view = steered(scenario, tmp_path / "run", script, monkeypatch, stop_every_ns=10 * MS)

    assert [answer.told for answer in view.answers] == [
        "injected-0: pause at 0.01 s", f"injected-1: {kind} at 0.03 s"]
    assert repeated(scenario, tmp_path / "run", tmp_path / "again") == hashes(tmp_path / "run")


def test_after_the_last_window_no_fault_can_be_injected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = scenario_in(tmp_path, 0.1)

    def script(view: SteeredView) -> None:
        if view.now_ns > 90 * MS and not view.answers:
            view.fault("pause", on="c")                     # so that the last window ends before the run does
        elif view.now_ns > 90 * MS:
            view.fault("clock_step", on="b", by_ms="1")

    view = steered(scenario, tmp_path / "run", script, monkeypatch, stop_every_ns=50 * MS)

    assert view.answers[-1].error == "the run is at its end, 0.1 s: nothing can be injected any more"
    assert len(view.answers) > 1
    assert repeated(scenario, tmp_path / "run", tmp_path / "again") == hashes(tmp_path / "run")


def test_a_fault_that_the_scenario_could_not_have_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = scenario_in(tmp_path, 0.1, '[[faults]]\nkind = "pause"\non = "c"\nat_s = 0.05\nlasts_s = 0.02\n')

    def script(view: SteeredView) -> None:
        if view.now_ns == 20 * MS and not view.answers:
            view.fault("kill", on="c")

    view = steered(scenario, tmp_path / "run", script, monkeypatch, stop_every_ns=10 * MS)

    assert [answer.error for answer in view.answers] == [
        "fault: faults[1]: kill of c at 0.02 s: faults[0] (pause) takes it away from 0.05 s until 0.07 s; let one end "
        "before the next begins"]
    assert repeated(scenario, tmp_path / "run", tmp_path / "again") == hashes(tmp_path / "run")
