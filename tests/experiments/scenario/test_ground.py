"""The ground that programs declare: part of the resolved scenario, and refused with the agent's name."""

from __future__ import annotations

from pathlib import Path

import pytest

import marconet
from experiments.scenario import ScenarioError

PROGRAM = '''
from firmware_sim.ground_plan import GroundPlan, GroundShape


class Still:
    def __init__(self, board):
        pass

    @staticmethod
    def ground_plan({arguments}):
        return {plan}


class Plain:
    def __init__(self, board):
        pass
'''
BOX = 'GroundPlan((0.0, team["east_m"]), (0.0, 2.0), (GroundShape("box", ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))),))'


def scenario(folder: Path, name: str, plan: str, arguments: str = "settings, team") -> marconet.Scenario:
    (folder / f"{name}.py").write_text(PROGRAM.format(plan=plan, arguments=arguments))
    agents = {"a": {"program": f"{name}:Still"}, "b": {"program": f"{name}:Still"}, "c": {"program": f"{name}:Plain"}}
    return marconet.Scenario("still", folder=folder, seed=1, length_s=0.1, team={"east_m": 3.0}, agents=agents)


def test_what_several_agents_declare_alike_is_once_in_the_resolved_scenario(tmp_path: Path) -> None:
    found = scenario(tmp_path, "ground_declared", BOX).resolved()

    assert found["ground"] == {"area_x_m": [0.0, 3.0], "area_y_m": [0.0, 2.0], "shapes": [
        {"what": "box", "corners_m": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], "solid": True}]}
    assert found["modes"] == {}


@pytest.mark.parametrize(("name", "plan", "arguments", "problem"), [
    ("ground_none", "None", "settings, team", "agents.a: Still.ground_plan returned NoneType: expected a GroundPlan"),
    ("ground_fails", "team['width']", "settings, team", "agents.b: Still.ground_plan failed: KeyError: 'width'"),
    ("ground_wrong", "None", "team", "expected ground_plan(settings, team), which returns the ground on which"),
])
def test_a_declaration_that_fails_is_refused(
        name: str, plan: str, arguments: str, problem: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as error:
        scenario(tmp_path, name, plan, arguments)

    assert problem in "\n".join(error.value.problems)
