"""The command `marconet table`: what it judges, prints and draws; and that the page of numbers is what it prints."""

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from experiments.show.tables import Measured, Row, figures_5
from experiments.show.tables.chapter_3 import TABLES
from experiments.show.tables.chapter_5 import TABLES as CHAPTER_5
from experiments.show.tables.estimation import CELLS
from experiments.show.tables.figures import figures, render
from marconet.command_line import app

PAGE = Path(__file__).parents[4] / "docs" / "reproduction.md"


class StubTable:
    title = "Table 0.0: of a stub"
    judged_by = "Judged by a guess."
    runs = 3

    def __init__(self, *ours):
        self.ours = ours

    def steps(self, runs):
        return runs * len(self.ours)

    def measure(self, runs, progress):
        for value in self.ours:
            for _ in range(runs):
                progress()
            yield Measured(Row("17 detections, UKF", "RMSE", "m", 0.4623, 0.0334, 0.172, 0.272), value, 0.0027, runs)


def table(monkeypatch, stub, *arguments):
    monkeypatch.setitem(TABLES, "3.1", stub)
    return CliRunner().invoke(app, ["table", "3.1", *arguments], env={"COLUMNS": "200"})


def test_cells_that_are_met_exit_with_0_and_show_printed_beside_ours(monkeypatch):
    result = table(monkeypatch, StubTable(0.2233))

    assert result.exit_code == 0
    assert result.stdout.splitlines()[:2] == ["Table 0.0: of a stub (3 runs)", "Judged by a guess."]
    assert result.stdout.splitlines()[-1].split() == [
        "17", "detections,", "UKF", "RMSE", "[m]", "0.4623", "0.2233", "+-", "0.0300", "0.172", "to", "0.272", "0.033",
        "0.0027", "met,", "not", "reproduced"]


@pytest.mark.parametrize(("printed", "low", "high", "reproduced"), [
    (1.0, 1.0, 2.0, True), (2.0, 1.0, 2.0, True), (0.99, 1.0, 2.0, False), (2.01, 1.0, 2.0, False),
    (None, 1.0, 2.0, None), (1.0, None, None, None), (9.0, None, 2.0, None)])
def test_a_printed_value_outside_of_the_band_is_not_reproduced(printed, low, high, reproduced):
    assert Row("", "", "", printed, None, low, high).reproduced is reproduced


def test_one_cell_that_is_missed_exits_with_1_and_is_named(monkeypatch):
    result = table(monkeypatch, StubTable(0.2233, 0.3), "--runs", "5")

    assert result.exit_code == 1
    assert "MISSED" in result.stdout
    assert result.stderr.splitlines() == [
        "table 3.1, 17 detections, UKF: RMSE=0.3000 m: expected 0.172 to 0.272"]


@pytest.mark.parametrize(("low", "high", "ours", "met"), [
    (1.0, 2.0, 1.0, True), (1.0, 2.0, 2.0, True), (1.0, 2.0, 0.99, False), (1.0, 2.0, 2.01, False),
    (None, 2.0, 2.0, True), (None, 2.0, 2.1, False), (None, None, 2.0, None), (None, 2.0, None, None)])
def test_a_value_is_judged_by_its_bounds(low, high, ours, met):
    assert Measured(Row("", "", "", None, None, low, high), ours, None, 2).met is met


@pytest.mark.parametrize("number", TABLES)
def test_every_table_can_be_computed_and_calls_progress_as_often_as_it_says(number, monkeypatch):
    if number in ("3.1", "3.3"):        # one quick row of each filter
        path = "circle" if number == "3.1" else "zig-zag"
        monkeypatch.setitem(CELLS, path, [cell for cell in CELLS[path] if cell.detections in (17, 25)])
    found, calls = TABLES[number], []

    values = list(found.measure(2, lambda: calls.append(1)))

    assert len(calls) == found.steps(2)
    assert all(value.ours is None or value.ours > 0 for value in values)


def test_the_figures_are_drawn_from_numbers_in_the_page_alone(monkeypatch):
    monkeypatch.setattr("experiments.show.tables.figures.STATISTICS_RUNS", 2)
    drawn = figures(lambda: None)

    page = render(drawn)

    assert [figure["number"] for figure in drawn] == [
        "3.5 (a)", "3.5 (b)", "3.6 (a)", "3.6 (b)", "3.6 (c)", "3.6 (d)", "3.8 (a)", "3.8 (b)", "3.8 (c)", "3.8 (d)"]
    assert [len(figure["seen"]["x"]) for figure in drawn[:6:2]] == [19, 102, 25]
    assert all(len(figure["error_m"]) == len(figure["t_s"]) == 786 for figure in drawn[6:])
    (held,) = re.findall(r'<script id="data" type="application/json">(.*?)</script>', page, re.DOTALL)
    assert json.loads(held) == drawn
    own = page.replace((page[page.index("<script>/**"):page.rindex("<script>")]), "")       # without Plotly
    assert re.findall(r"(?:src|href)=\"(?!data:)", own) == []


def page_rows(number):
    """Of a table of the page: {name: (ours, its standard error)}."""
    text = PAGE.read_text(encoding="utf-8")
    part = text[text.index(f"### Table {number}"):].split("\n### ")[0]
    lines = [[cell.strip() for cell in line.split("|")] for line in part.splitlines() if "+-" in line]
    return {cells[1]: tuple(float(number) for number in cells[3].split(" +- ")) for cells in lines}


def compare_with_the_page(number):
    """The runs have fixed seeds; what another machine's rounding can change is far below half a standard error."""
    on_page = page_rows(number)

    for value in TABLES[number].measure(100, lambda: None):
        ours, error = on_page.pop(name_on_the_page(value))
        assert abs(ours - value.ours) <= 0.5 * error
        assert value.standard_error == pytest.approx(error, rel=0.1, abs=0.00006)

    assert on_page == {}


def name_on_the_page(value):
    return f"{value.row.what}, {value.row.quantity}"


@pytest.mark.slow
@pytest.mark.parametrize("number", ["3.2", "3.4"])
def test_the_page_of_numbers_has_what_the_adaptive_filter_gives(number):
    compare_with_the_page(number)


@pytest.mark.slow
@pytest.mark.parametrize("number", ["3.1", "3.3"])
def test_the_page_of_numbers_has_what_the_filters_give(number):
    compare_with_the_page(number)


@pytest.mark.slow
@pytest.mark.parametrize("number", ["3.1", "3.2", "3.3", "3.4"])
def test_every_cell_is_what_it_has_to_be(number):
    values = list(TABLES[number].measure(100, lambda: None))

    assert [name_on_the_page(value) for value in values if value.met is False] == []


def test_chapter_5_calls_progress_once_a_row_and_meets_its_bands():
    found, calls = CHAPTER_5["5.1"], []

    values = list(found.measure(2, lambda: calls.append(1)))

    assert len(calls) == found.steps(2) == len(values)
    assert [value.met for value in values] == [True] * len(values)


@pytest.mark.slow
def test_figures_of_chapter_5_show_the_run_with_its_looks():
    steps = []

    drawn = figures_5.figures(lambda: steps.append(1))

    assert len(steps) == figures_5.STEPS
    assert [figure["number"] for figure in drawn] == ["5.3", "5.3 (F3)", "5.4 (a)", "5.4 (b)", "5.4 (c)", "5.4 (d)"]
    printed = [value for row in drawn[0]["z"] for value in row]
    assert max(printed) - min(printed) < 1e-3
    assert abs(printed[0] - 375) < 0.05
    assert [len(figure["lines"]) for figure in drawn[2:]] == [3, 1, 1, 1]
    assert drawn[4]["changes_s"] == [1.83, 8.8]
    assert all("NaN" not in json.dumps(figure) for figure in drawn)
