"""The Marco Polo game with a radio that reaches neighbours only: what holds while the team is connected, and when not.

The graph of who hears whom is taken from the places in the records, apart from the radio and from `team_parts`.
"""

from __future__ import annotations

from collections import Counter
from functools import cache
from math import dist
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pyarrow.parquet as pq
import pytest

from agents.bidding.bid_timing import BidTiming
from agents.marco_polo_game.team_parts import team_parts
from experiments.judge.run_data import RunData
from experiments.scenario import find, load
from tests.agents.bidding.test_bounds_in_scenarios import timing_of
from tests.agents.marco_polo_game.test_game_runs import MS, S, counted, places_of, played, task_of, told

NAME = "marco_polo_hops"
RANGE_M = 10 ** ((80 - 27.9 - 40) / 20)         # sensitivity -80 dBm, -27.9 dBm sent, 40 dB at 1 m, exponent 2
CONNECTED, PARTED = 121, 1000
MORE_CONNECTED, MORE_PARTED = (pytest.param(seed, marks=pytest.mark.slow) for seed in (1001, 1003))


@cache
def timing() -> BidTiming:
    return timing_of(load(find(NAME)))


def diameters(data: RunData) -> dict[int, int]:
    """Hops between the sensors that are furthest apart, by instant; 0 while the team is in parts."""
    team: Any = data.scenario["team"]["sensors"]
    places = {name: places_of(data, name) for name in team}
    found = {}
    for at_ns in places[team[0]]:
        graph = nx.Graph((one, other) for one in team for other in team
                         if dist(places[one][at_ns], places[other][at_ns]) <= RANGE_M)
        found[at_ns] = nx.diameter(graph) if nx.is_connected(graph) else 0
    return found


def test_both_hosts_have_one_ledger(tmp_path: Path) -> None:
    _, inline = played(tmp_path / "inline", PARTED, "length_s=12", name=NAME)
    _, process = played(tmp_path / "process", PARTED, "length_s=12", host="process", name=NAME)

    assert inline.ledger_hash == process.ledger_hash


@pytest.mark.parametrize("seed", [CONNECTED, MORE_CONNECTED])
def test_while_the_team_is_connected_one_sensor_is_deployed_for_each_task(seed: int, tmp_path: Path) -> None:
    data, summary = played(tmp_path / "run", seed, name=NAME)

    assert summary.holds
    assert 2 <= max(hops := diameters(data).values()) <= timing().settings.most_hops
    assert min(hops) > 0
    assert set(Counter(task_of(detail)[:3] for _, _, detail in told(data, "deployed")).values()) == {1}
    opened_ns: dict[tuple[str, ...], int] = {}
    for _, time_ns, detail in told(data, "window open"):
        opened_ns.setdefault(task_of(detail), time_ns)
    for _, time_ns, detail in told(data, "deployed"):
        assert 0 <= time_ns - opened_ns[task_of(detail)] - timing().settings.window_ns <= timing().apart_ns
    assert counted(data, "let go") == counted(data, "sensors silent") == 0


@pytest.mark.parametrize("seed", [PARTED, MORE_PARTED])
def test_a_team_in_parts_deploys_two_and_one_lets_go_when_the_parts_meet(seed: int, tmp_path: Path) -> None:
    data, summary = played(tmp_path / "run", seed, name=NAME)

    assert summary.holds
    hops = diameters(data)
    (_, gone_ns, detail), = told(data, "let go")
    task = task_of(detail)[:3]
    deployed = [time_ns for _, time_ns, other in told(data, "deployed") if task_of(other)[:3] == task]
    parted = [at_ns for at_ns, most in hops.items() if not most]
    assert len(deployed) == 2
    assert deployed[0] < min(parted) < deployed[1] < max(parted) + 100 * MS
    assert 0 < gone_ns - (max(parted) + 100 * MS) <= timing().healing_ns


def test_the_formula_fails_without_its_condition(tmp_path: Path) -> None:
    two = "max(investigators.target_1, investigators.target_2, investigators.target_3)"

    _, summary = played(tmp_path / "run", PARTED, f"expect={{ one = 'always({two} < 1.5)' }}", name=NAME)

    assert not summary.holds


def test_the_times_of_the_formulas_are_those_of_the_protocol() -> None:
    scenario = load(find(NAME))
    sample_ns = 100 * MS
    settled_ns = timing().settings.window_ns + timing().apart_ns + timing().healing_ns + sample_ns

    assert abs(settled_ns - 1.56 * S) < 10 * MS
    for key in ("one_investigates", "one_pursues"):
        assert scenario.expect[key].formula.startswith("always(always[0, 1.56 s] team.parts < 1.5 implies")


def test_a_change_of_mode_names_the_neighbour_whose_frame_told_of_it(tmp_path: Path) -> None:
    """uav_1 learns of the detection by uav_2, which it has never heard, and ends its investigation."""
    data, summary = played(tmp_path / "run", PARTED, name=NAME)

    heard = {copy["sender"] for copy in pq.read_table(tmp_path / "run" / "ledger.parquet").to_pylist()
             if (copy["medium"], copy["receiver"], copy["fate"]) == ("radio", "uav_1", "delivered")}
    ended, = (detail for node, _, detail in told(data, "mode", "investigating -> waiting") if node == "uav_1")
    teller = ended.partition(" by ")[2].partition(":")[0]
    assert summary.holds                                    # with uav_2 as cause, `executions` is violated
    assert "uav_2" not in heard
    assert teller in heard
    assert ended.endswith(": k detections")


def test_parts_are_those_of_the_graph_and_the_dead_are_in_none() -> None:
    nan = np.nan
    x = [np.array([0.0, 0.0, 0.0]), np.array([1.0, 1.0, nan]), np.array([2.0, 2.5, 2.0])]
    y = [np.zeros(3), np.array([0.0, 0.0, nan]), np.zeros(3)]

    parts, = team_parts(*(signal for pair in zip(x, y, strict=True) for signal in pair), range_m=1.0)

    assert parts.tolist() == [1.0, 2.0, 2.0]
