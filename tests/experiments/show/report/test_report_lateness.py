"""The section on lateness: figures and bins of a run in real time, and its chart in a browser."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import find, load
from experiments.show.report.build import write_report
from experiments.show.report.lateness import lateness
from tests.browser import browser, needs_browser


@pytest.fixture(scope="module")
def paced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("paced") / "run"
    run(load(find("output_sync"), duration_s=0.3), host="inline", out=folder, report=False, real_time=True)
    return folder


def test_each_event_is_in_the_bin_of_its_lateness(paced: Path) -> None:
    data = load_run(paced)
    told = data.run["real_time"]

    found = lateness(data)

    assert found is not None
    deliveries, instants = found["kinds"]
    assert sum(deliveries["counts"]) == deliveries["events"] == told["deliveries"]["events"] > 100
    assert sum(instants["counts"]) == instants["events"] == told["instants"]
    assert instants["worst"] == told["worst_ns"] / 1e6
    last_ms = 10 ** instants["from_log_ms"][-1]
    assert last_ms <= instants["worst"] * 33 / 32 + 1e-9        # a bucket of the record is 1/32 wide
    assert instants["worst"] < last_ms * 10 ** 0.1


def test_a_run_in_virtual_time_has_no_such_section(tmp_path: Path) -> None:
    run(load(find("output_sync"), duration_s=0.1), host="inline", out=tmp_path / "run", report=False)

    page = write_report(tmp_path / "run").read_text()

    assert "plot-lateness\"" not in page.partition("<script")[0]
    assert lateness(load_run(tmp_path / "run")) is None


@pytest.mark.slow
@needs_browser
def test_the_histogram_is_drawn(paced: Path, tmp_path: Path) -> None:
    page = write_report(paced)
    with browser(tmp_path) as screen:
        screen.show(page)

        assert screen.errors == []
        assert screen.run("document.querySelectorAll('#plot-lateness .barlayer .trace.bars').length") == 2
        bars = screen.run("document.querySelectorAll('#plot-lateness .bars')[0].querySelectorAll('.point').length")
        assert bars == len(lateness(load_run(paced))["kinds"][0]["counts"])  # type: ignore[index]
        assert "lateness" in screen.run("[...document.querySelectorAll('#contents a')].map((a) => a.hash).join()")
