"""The charts of programs: kept in the folder of a run before it starts, drawn by its report, asked for only there."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from experiments.judge.run_data import load_run
from experiments.run.figures import Repeated
from experiments.run.run_folder import RunFolder
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from experiments.scenario.model import Scenario
from experiments.show.report.build import render

PROGRAM = '''
from firmware_sim.height_chart import HeightChart


class Surveyor:
    def __init__(self, board):
        pass

    @staticmethod
    def charts(scenario, own):
        names = " and ".join(own)
        return {charts}
'''
HILL = ('[HeightChart(f"Hill of {names}", "</script> &", "x [m]", "y [m]", "m", [0.0, 1.0], [0.0, 2.0], '
        '[[1, 2], [3, 7]])]')


def scenario(folder: Path, name: str, charts: str = HILL) -> Scenario:
    (folder / f"{name}.py").write_text(PROGRAM.format(charts=charts))
    agents = "".join(f"[agents.{agent}]\nprogram = '{name}:Surveyor'\n" for agent in "ab")
    (folder / "hills.toml").write_text(f"seed = 1\nlength_s = 0.01\n{agents}")
    return load(folder / "hills.toml")


def test_a_chart_is_in_the_folder_and_on_the_page(tmp_path: Path) -> None:
    folder = run(scenario(tmp_path, "charts_drawn"), host="inline", out=tmp_path / "run").folder

    (chart,) = load_run(folder).charts
    page = (folder / "report.html").read_text()

    assert (chart.title, chart.z) == ("Hill of a and b", [[1, 2], [3, 7]])
    assert page.count("<figcaption>Hill of a and b</figcaption>") == page.count('id="plot-chart-0"') == 1
    assert '<a href="#charts">Made before the run' in page
    assert '<p class="note">&lt;/script&gt; &amp;</p>' in page
    assert '"note":"\\u003c/script> &"' in page


def test_a_run_without_charts_keeps_none(tmp_path: Path) -> None:
    folder = run(scenario(tmp_path, "charts_none", "()"), host="inline", out=tmp_path / "run").folder

    assert not (folder / "charts.json").exists()
    assert 'id="charts"' not in (folder / "report.html").read_text()


def test_a_run_of_a_campaign_asks_for_no_charts(tmp_path: Path) -> None:
    made = scenario(tmp_path, "charts_unasked", "1 / 0")

    figures = Repeated(lambda seed: made, "inline").run(1)

    assert figures.failure == ""


def test_what_is_no_chart_is_refused_before_the_run(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"hills: charts_wrong:Surveyor: charts returned str: expected HeightChart"):
        run(scenario(tmp_path, "charts_wrong", "['hill']"), host="inline", out=tmp_path / "run")

    assert not (tmp_path / "run").exists()


def test_charts_that_cannot_be_read_are_told_and_the_next_run_removes_them(tmp_path: Path) -> None:
    folder = run(scenario(tmp_path, "charts_damaged"), host="inline", out=tmp_path / "run").folder
    (folder / "charts.json").write_text(json.dumps([{"title": "hill"}]))

    data = load_run(folder)
    page = render(data, folder)
    RunFolder.claim(folder, overwrite=True).release()

    assert data.charts == ()
    assert [line for line in data.missing if line.startswith("charts.json: unreadable: ")]
    assert "charts.json: unreadable" in page
    assert not (folder / "charts.json").exists()
