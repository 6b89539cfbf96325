"""The pages of campaigns as a browser draws them: every plot is drawn, no error, no address on the network."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from experiments.judge.campaign import Campaign, Plan, Row
from experiments.judge.figures import Figures
from experiments.run.runner import run
from experiments.scenario import find, load
from experiments.scenario.model import Bound
from experiments.show.campaign.build import render, write_campaign_report
from experiments.show.campaign.compare import NotComparable, compare
from tests.browser import Browser, browser, needs_browser

pytestmark = needs_browser


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


def campaign(folder: Path, sample: str = "grid", shift: float = 0.0) -> Campaign:
    """Two keys with 3 and 2 values, 4 seeds; run 5 failed and run 6 has no figure."""
    settings = [{"team.gain": gain, "media.radio.preset": preset}
                for gain in (0.5, 1.0, 2.0) for preset in ("a<b", "c")]
    plan = Plan("two <rovers>", "Do they meet?", "/s/two.toml", "0", 2.0, (), {}, ("team.gain", "media.radio.preset"),
                tuple(settings), (7, 8, 9, 10), "inline", {"r1.gap.min": Bound(min=0.5), "frames_lost": Bound(max=9.0)},
                sample)
    rows = []
    for number, (setting, seed) in enumerate(plan.pairs()):
        gap, lost = shift + 0.4 + 0.1 * setting + 0.01 * (seed - 7), float(setting + seed % 3)
        broken = ["r1.gap.min"] if gap < 0.5 else []
        rows.append(Row(number, setting, Figures(
            seed, "h", not broken and number != 5, {"r1.gap.min": None if number == 6 else gap, "frames_lost": lost},
            broken, "RuntimeError: <no fuel>" if number == 5 else "", 0.9, 1.0)))
    folder.mkdir(parents=True, exist_ok=True)
    return Campaign(folder, plan, rows)


@pytest.mark.parametrize("dark", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("sample", "plots"), [("grid", 2 * 3),
                                               pytest.param("latin", 2 * 2, marks=pytest.mark.slow)])
def test_the_report_draws_every_plot(page: Browser, tmp_path: Path, sample: str, plots: int, dark: bool) -> None:
    found = campaign(tmp_path / "c", sample)
    (tmp_path / "c" / "runs" / "0-7").mkdir(parents=True)
    (tmp_path / "c" / "runs" / "0-7" / "report.html").write_text("<p>here")

    page.show(write_campaign_report(found, {0: tmp_path / "c" / "runs" / "0-7"}), dark=dark)

    assert page.errors == []
    assert page.run("document.querySelectorAll('.plot .main-svg').length >= 1")
    assert page.run("[...document.querySelectorAll('.plot')].filter(plot => plot.querySelector('.trace')).length"
                    ) == plots
    assert page.run("document.querySelector('.verdict').textContent") == "19 of 24 runs hold: 79.2 % [57.8 %, 92.9 %]"
    assert page.run("document.querySelector('#failures tbody').textContent").count("<no fuel>") == 1
    assert page.run("document.querySelectorAll('#failures tbody tr').length") == 5
    assert page.run("document.querySelector('#failures a').getAttribute('href')") == "runs/0-7/report.html"
    assert page.run("document.querySelector('#worst').textContent").count("0.1 beyond its bound") == 1
    assert page.run("document.documentElement.scrollWidth <= window.innerWidth")


def test_of_seeds_alone_each_figure_has_a_histogram_with_its_bound(tmp_path: Path) -> None:
    found = campaign(tmp_path)
    plan = Plan("s", "", "s.toml", "0", None, (), {}, (), ({},), tuple(range(24)), "inline", found.plan.bounds)

    text = render(Campaign(tmp_path, plan, [Row(row.number, 0, row.figures) for row in found.rows]), {})

    assert text.count('"kind":"histogram"') == 2
    assert '"min":0.5' in text


def test_a_campaign_without_a_run_has_a_report_too(page: Browser, tmp_path: Path) -> None:
    found = campaign(tmp_path)

    page.show(write_campaign_report(Campaign(tmp_path, found.plan, []), {}))

    assert page.errors == []
    assert "24 of 24 runs are missing" in page.run("document.body.textContent")


def test_two_runs_are_drawn_one_over_the_other(page: Browser, tmp_path: Path) -> None:
    for seed in (1, 2):
        run(load(find("output_sync"), seed=seed, duration_s=0.5), host="inline", out=tmp_path / f"run{seed}",
            report=False)

    found = compare(tmp_path / "run1", tmp_path / "run2")
    page.show(found.write(tmp_path / "compare.html"))

    assert page.errors == []
    assert found.lines[-1] == "the ledgers differ"
    assert compare(tmp_path / "run1", tmp_path / "run1").lines[-1].startswith("the ledgers are equal")
    assert page.run("document.querySelectorAll('#plot-0 .scatterlayer .trace').length") == 10       # 5 robots, 2 runs
    assert page.run("[...document.querySelectorAll('#plot-0 .legendtext')].map(text => text.textContent)"
                    ).count("run1: r1") == 1


def test_what_cannot_be_compared_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "scenario.json").write_text("{}")
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / "campaign.json").write_text("{}")

    with pytest.raises(NotComparable, match="empty: holds neither a campaign nor a run"):
        compare(tmp_path / "run", tmp_path / "empty")
    with pytest.raises(NotComparable, match="there is no such folder"):
        compare(tmp_path / "nowhere", tmp_path / "run")
    with pytest.raises(NotComparable, match="give two of a kind"):
        compare(tmp_path / "run", tmp_path / "sweep")
