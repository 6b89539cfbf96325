"""Whole games with adaptive pursuits: looks on request, captures, and the cause of each failure against the truth."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from experiments.judge.run_data import RunData
from experiments.scenario import ScenarioError, find, load
from tests.agents.marco_polo_game.games import counted, told
from tests.agents.marco_polo_game.games import played as play

EXPOSURE_NS = 100_000_000
CAPTURES, LEAVES = 1113, 1001       # seeds: a UAV makes the third detection 2.4 m from the UGV, and 3.7 m from it


def played(out: Path, seed: int, *overrides: str, name: str = "marco_polo_adaptive",
           host: Any = "inline") -> tuple[RunData, Any]:
    return play(out, name, *overrides, seed=seed, host=host)


def lossy(*links: str) -> str:
    tables = (f"{{on='{link}', kind='bernoulli_loss', loss_ratio=1.0, during_s=[18.3, 60]}}" for link in links)
    return f"impairments=[{', '.join(tables)}]"


@pytest.mark.slow
def test_both_hosts_have_one_ledger(tmp_path: Path) -> None:
    _, inline = played(tmp_path / "inline", CAPTURES)
    _, process = played(tmp_path / "process", CAPTURES, host="process")

    assert inline.holds
    assert inline.ledger_hash == process.ledger_hash


@pytest.mark.slow
def test_until_a_pursuit_begins_the_game_is_that_of_marco_polo(tmp_path: Path) -> None:
    adaptive, _ = played(tmp_path / "adaptive", CAPTURES)
    plain, _ = played(tmp_path / "plain", CAPTURES, name="marco_polo")

    begins_ns = told(plain, "mode", "waiting -> pursuing")[0][1]
    assert told(adaptive, "mode", "waiting -> pursuing")[0][1] == begins_ns
    for kind in ("detection", "mode", "deployed"):
        before = [event for event in told(plain, kind) if event[1] < begins_ns]
        assert before
        assert [event for event in told(adaptive, kind) if event[1] < begins_ns] == before


def test_a_pursuit_that_fails_by_the_track_line_captures_with_far_fewer_looks_than_exposures(tmp_path: Path) -> None:
    data, summary = played(tmp_path / "adaptive", CAPTURES)
    plain, _ = played(tmp_path / "plain", CAPTURES, name="marco_polo")

    assert summary.holds
    assert counted(plain, "captures") == 0
    assert counted(data, "captures") == counted(data, "captured") == 1
    (_, begins_ns, _), = told(data, "mode", "waiting -> pursuing")
    (_, ends_ns, _), = told(data, "mode", "pursuing -> waiting")
    assert 0 < counted(data, "looks in pursuit") < 0.5 * (ends_ns - begins_ns) / EXPOSURE_NS


def test_a_pursuit_that_fails_says_that_the_target_left_and_it_had(tmp_path: Path) -> None:
    data, summary = played(tmp_path / "run", LEAVES)

    assert summary.holds
    (_, failed_ns, detail), = told(data, "pursuit failed")
    target = detail.partition(":")[0]
    assert detail.startswith(f"{target}: left S: ")
    left, = [time_ns for node, time_ns, _ in told(data, "mode", "inside -> left") if node == target]
    assert left < failed_ns
    assert counted(data, "pursuits without a capture") == counted(data, "pursuits failed: left S") == 1


@pytest.mark.parametrize(("links", "named"), [
    (["view_ugv: target_3 -> ugv_3"], "view_ugv: target_3 -> ugv_3"),
    (["grip: * -> *"], "grip: ugv_3 -> target_3"),
    pytest.param(["radio: uav_1 -> ugv_3", "grip: * -> *"], "radio: uav_1 -> ugv_3, grip: ugv_3 -> target_3",
                 marks=pytest.mark.slow),
])
def test_a_pursuit_that_fails_by_a_lost_link_names_it(links: list[str], named: str, tmp_path: Path) -> None:
    data, summary = played(tmp_path / "run", CAPTURES, lossy(*links))

    (node, _, detail), = told(data, "pursuit failed")
    assert node == "ugv_3"
    assert detail.startswith(f"target_3: lost link {named}; left S: ")
    assert counted(data, "pursuits failed: lost link") == 1
    assert [verdict.key for verdict in summary.verdicts if not verdict.holds] == [
        "count.*.pursuits failed: lost link"]


@pytest.mark.parametrize(("override", "said"), [
    ("agents.ugv_1.parameters.exposure_latency_ms=10",
     "agents.ugv_1.parameters.exposure_latency_ns=10000000: media.view_ugv has latency_ns=20000000; take the same"),
    ("media.view_ugv.noise_m=0.1", "agents.ugv_1.parameters.sigma_m=0.0: media.view_ugv has noise_m=0.1; take as much"),
    ("media.view_uav.every_exposure_to=['uav_1']", "uav_1 gets every exposure, and its program asks for those"),
    ("team.ugvs=[]", "team.ugvs: 0 UGVs, and a UAV cannot capture; add at least 1 UGV"),
    ("agents.ugv_1.parameters.filter_window=2", "a circle needs Gamma of 3 detections or more"),
])
def test_what_cannot_be_played_is_refused_with_what_would_do(override: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(said)):
        load(find("marco_polo_adaptive"), overrides=[override])
