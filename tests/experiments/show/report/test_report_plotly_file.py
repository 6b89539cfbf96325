"""Plotly inside the page, or once for all reports of a folder."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from experiments.show.report import plotly_file
from experiments.show.report.build import write_report
from experiments.show.report.plotly_file import plotly_name, plotly_source, shared_plotly

PLOTLY = plotly_name()


@pytest.fixture
def run(tmp_path: Path, make_run) -> Path:
    return make_run(tmp_path / "runs" / "one", 0.1)


@pytest.fixture
def other(run: Path) -> Path:
    """Another run beside it."""
    write_report(run)
    return Path(shutil.copytree(run, run.parent / "two"))


def test_a_run_that_lies_alone_has_plotly_inside(run: Path) -> None:
    page = write_report(run).read_text()

    assert plotly_source() in page
    assert not (run.parent / PLOTLY).exists()


def test_runs_of_one_folder_share_one_file(run: Path, other: Path) -> None:
    for folder in (run, other):
        page = write_report(folder)

        assert f'<script src="../{PLOTLY}"></script>' in page.read_text()
        assert plotly_source() not in page.read_text()
    assert (run.parent / PLOTLY).read_text() == plotly_source()
    assert [path.name for path in run.parent.iterdir() if path.is_file()] == [PLOTLY]


def test_a_page_to_send_has_it_inside_wherever_it_lies(other: Path) -> None:
    page = write_report(other, "inside").read_text()

    assert plotly_source() in page
    assert 'src="' not in page.replace(plotly_source(), "")


@pytest.mark.parametrize("found", ["", "alert(1)"])
def test_a_file_that_is_not_what_it_should_be_is_replaced(other: Path, found: str) -> None:
    (other.parent / PLOTLY).write_text(found)

    assert shared_plotly(other) == f"../{PLOTLY}"
    assert (other.parent / PLOTLY).read_text() == plotly_source()


def test_where_the_file_cannot_lie_beside_the_page_holds_it(other: Path) -> None:
    (other.parent / PLOTLY).mkdir()

    assert shared_plotly(other) is None


def test_a_file_of_somebody_else_is_not_run(other: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (other.parent / PLOTLY).write_text(plotly_source())
    owner = (other.parent / PLOTLY).stat().st_uid
    monkeypatch.setattr(plotly_file.os, "getuid", lambda: owner + 1)

    assert shared_plotly(other) is None


def test_the_file_is_named_by_the_version_of_plotly_js_that_it_holds() -> None:
    assert re.fullmatch(r"plotly-\d+\.\d+\.\d+\.min\.js", PLOTLY)
    assert f"plotly.js v{PLOTLY.removeprefix('plotly-').removesuffix('.min.js')}" in plotly_source()[:100]
