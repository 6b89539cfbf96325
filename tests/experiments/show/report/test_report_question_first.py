"""`question_signal` decides what the report and the picture show first."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from experiments.judge.run_data import RunData, load_run
from experiments.show.report.picture import write_picture
from experiments.show.report.question_first import no_such_signal, question_first


@pytest.fixture
def asking(whole_run: Path, tmp_path: Path) -> Callable[[str], RunData]:
    """The run of the tests, its scenario asking about a signal."""
    def ask(pattern: str) -> RunData:
        run = tmp_path / "run"
        shutil.copytree(whole_run, run, dirs_exist_ok=True)
        scenario = json.loads((run / "scenario.json").read_text())
        (run / "scenario.json").write_text(json.dumps(scenario | {"question_signal": pattern}))
        return load_run(run)
    return ask


def drawn(data: RunData) -> list[tuple[str, list[str]]]:
    return [(entry["name"], [curve["label"] for curve in entry["curves"]]) for entry in question_first(data)]


def test_a_signal_of_all_nodes_comes_first_and_only_once(asking) -> None:
    names = [name for name, _ in drawn(asking("*.error"))]

    assert names == ["error", "y", "u"]


def test_some_nodes_of_a_signal_are_drawn_alone_and_the_signal_of_all_stays(asking) -> None:
    found = drawn(asking("r[12].y"))

    assert found[:2] == [("y", ["r1", "r2"]), ("y", ["r1", "r2", "r3", "r4", "r5"])]


def test_several_signals_of_one_node_are_drawn_together(asking) -> None:
    assert drawn(asking("r3.*"))[0] == ("r3: error, u, y", ["y", "u", "error"])


def test_without_it_outputs_come_first(asking) -> None:
    assert [name for name, _ in drawn(asking(""))] == ["y", "error", "u"]


def test_a_signal_that_no_program_recorded_is_told_with_the_nearest(asking) -> None:
    data = asking("r1.eror")

    assert no_such_signal(data) == "question_signal='r1.eror': no recorded signal matches; nearest: r1.error"
    assert [name for name, _ in drawn(data)] == ["y", "error", "u"]


def test_the_picture_shows_it_too(asking, tmp_path: Path) -> None:
    asking("r[12].u")

    root = ElementTree.parse(write_picture(tmp_path / "run")).getroot()

    assert len(root.findall("{http://www.w3.org/2000/svg}polyline")) == 2
    assert "u [V]" in "".join(root.itertext())
