"""docs/models/optimal_triggering.md: the runs of the scenario print the figures of its table of policies."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from experiments.run.runner import run
from experiments.scenario import load
from experiments.scenario.library import find
from tests.docs.page import ROOT

PAGE = (ROOT / "docs/models/optimal_triggering.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `(\w+)` \| (\d+) \| ([\d.]+) J \| ([\d.]+) \|$", PAGE, re.MULTILINE)


def test_the_table_has_three_policies() -> None:
    assert [policy for policy, *_ in ROWS] == ["optimal", "individual_gains", "periodic"]


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "looks", "energy_j", "cost"), ROWS)
def test_a_run_costs_what_the_page_says(policy: str, looks: str, energy_j: str, cost: str, tmp_path: Path) -> None:
    scenario = load(find("tracking_optimal"), overrides=[f'agents.companion.parameters.policy="{policy}"'])

    summary = run(scenario, host="inline", out=tmp_path, report=False).summary
    verdicts = {each.key: each.value for each in summary.verdicts}

    assert verdicts["count.companion.measurements"] == float(looks)
    assert f"{verdicts['cost.energy']:.3f}" == energy_j
    assert f"{verdicts['cost.total']:.2f}" == cost
