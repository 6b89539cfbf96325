"""docs/scenario.md: its example runs, and no key of the format is missing from it."""

from __future__ import annotations

import re
import sys
from dataclasses import fields
from pathlib import Path

import pytest

from experiments.scenario import load
from experiments.scenario.agents import AgentTable, PlantTable
from experiments.scenario.faults import FaultHeader
from experiments.scenario.guarantee_kinds import MONITORS
from experiments.scenario.guarantees import GuaranteeHeader
from experiments.scenario.loader import Header
from experiments.scenario.metric_keys import STATISTICS, guarantee_figures
from experiments.scenario.network import ImpairmentHeader
from experiments.scenario.sections import SECTIONS
from experiments.scenario.shape import shape_of
from firmware_sim.clock_settings import ClockSettings
from netem.faults.table import FAULTS
from netem.impairments.table import IMPAIRMENTS
from netem.media.table import MEDIA

PAGE = Path(__file__).parents[3] / "docs" / "scenario.md"


@pytest.fixture
def page() -> str:
    return PAGE.read_text(encoding="utf-8")


@pytest.fixture
def example(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "my_robots", raising=False)
    scenario, robots = (re.search(rf"```{language}\n(.*?)```", page, re.DOTALL) for language in ("toml", "python"))
    assert scenario is not None
    assert robots is not None
    (tmp_path / "my_robots.py").write_text(robots[1])
    (tmp_path / "door.toml").write_text(scenario[1])
    return tmp_path / "door.toml"


def test_the_example_loads(example):
    scenario = load(example)

    assert scenario.question == "does the second still hear most of what the first says?"
    assert scenario.agents["r2"].parameters == {"period_ns": 10_000_000, "offset_ns": 5_000_000}


def test_the_example_runs_and_its_expectations_hold(example):
    from experiments.run.runner import run

    result = run(load(example), host="inline", out=example.parent / "run")

    assert [verdict.by_how_much() for verdict in result.summary.verdicts] == ["", "", "", ""]


@pytest.mark.parametrize("cls", [Header, AgentTable, PlantTable, ImpairmentHeader, ClockSettings, FaultHeader,
                                 GuaranteeHeader, *IMPAIRMENTS.values(), *FAULTS.values(), *MONITORS.values()],
                         ids=lambda cls: cls.__name__)
def test_every_key_is_documented(cls, page):
    for name in shape_of(cls).hints:
        assert f"`{re.sub('_ns$', '_s', name)}`" in page


def test_every_section_kind_and_statistic_is_documented(page):
    figures = [*guarantee_figures("s"), *guarantee_figures("")]
    for word in [*MEDIA, *IMPAIRMENTS, *FAULTS, *STATISTICS, *MONITORS, *figures]:
        assert f"`{word}`" in page
    for section in SECTIONS:
        assert re.search(rf"`\[+{section}[.\]]", page)


def test_documented_defaults_are_the_defaults():
    defaults = {field.name: field.default for field in fields(Header)}

    assert (defaults["sample_period_ns"], defaults["node_timeout_s"]) == (10_000_000, 30.0)
    assert ClockSettings() == ClockSettings(0, 0.0, 1)
