"""An expectation with a share judges no single run, but a campaign; the command and its report say what is shown."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from junitparser import JUnitXml

from experiments.judge.campaign import load_campaign
from experiments.scenario import ScenarioError, load
from marconet.command_line import app

SHARE = ("--set", "impairments[0].loss_ratio=0.45", "--set", "expect.delivery_ratio.min=0.55",
         "--set", "expect.delivery_ratio.share={}")


def called(*words: object) -> tuple[int, str, str]:
    found = CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "200"})
    return found.exit_code, found.stdout, found.stderr


def shares(share: float) -> list[str]:
    return [word.format(share) for word in SHARE]


def test_a_campaign_shows_a_share_that_some_runs_break(beacons: Path, tmp_path: Path) -> None:
    code, out, err = called("sweep", beacons, "--seeds", 16, "--jobs", 1, "--folders", 0, "--out", tmp_path / "c",
                            *shares(0.05))

    found = load_campaign(tmp_path / "c")
    kept = sum(row.figures.values["delivery_ratio"] >= 0.55 for row in found.rows)
    assert 3 < kept < 16                                        # the loss ratio leaves about half of them below it
    assert all(row.figures.holds for row in found.rows)
    assert f"delivery_ratio  {kept} of 16" in out
    assert "at least 5 %: shown" in out
    assert (code, err.count('expect.')) == (0, 0)
    report = (tmp_path / "c" / "report.html").read_text()
    assert f"<td><code>delivery_ratio</code></td><td>0.55</td><td></td><td>{kept} of 16</td>" in report
    assert '<p class="verdict holds">16 of 16 runs hold' in report


def test_a_share_that_is_refuted_or_undecided_is_no_success(beacons: Path, tmp_path: Path) -> None:
    code, out, err = called("sweep", beacons, "--seeds", 12, "--jobs", 1, "--folders", 0, "--out", tmp_path / "c",
                            "--json", *shares(0.99))

    rated, plain = json.loads(out)["expectations"]
    assert code == 1
    assert rated["showing"] in ("refuted", "undecided")
    assert (rated["key"], rated["expected_share"], plain["showing"]) == ("delivery_ratio", 0.99, None)
    assert f"expect.delivery_ratio: kept by {rated['kept']} of 12 runs: at least 99 %: {rated['showing']}" in err
    assert '<p class="verdict fails">12 of 12 runs hold' in (tmp_path / "c" / "report.html").read_text()


def test_a_single_run_beyond_the_bound_holds_and_says_so(beacons: Path, tmp_path: Path) -> None:
    code, out, _ = called("run", beacons, "--host", "inline", "--out", tmp_path / "run", "--junit", tmp_path / "j.xml",
                          "--set", "expect.delivery_ratio={min=0.99, share=0.5}")

    verdict, _ = json.loads((tmp_path / "run" / "summary.json").read_text())["verdicts"]
    assert code == 0
    assert (verdict["holds"], verdict["beyond"], verdict["share"]) == (True, True, 0.5)
    assert "beyond: " in out
    assert "below the least allowed, 0.99; expected of 50 % of a campaign's runs" in out
    assert "beyond: " in (tmp_path / "run" / "report.html").read_text()
    assert JUnitXml.fromfile(str(tmp_path / "j.xml")).failures == 0


def test_a_guarantee_with_a_share_may_be_violated_in_a_single_run(beacons: Path, tmp_path: Path) -> None:
    text = beacons.read_text().replace("[expect]", '[guarantees.few]\nkind = "successive_losses"\n'
                                       'on = "radio: * -> *"\nat_most = 0\nshare = 0.5\n[expect]')
    beacons.write_text(text)

    code, out, err = called("run", beacons, "--host", "inline", "--out", tmp_path / "run")

    assert (code, err.count("guarantees.few")) == (0, 0)
    assert "guarantee.few.violations" in out
    assert load(beacons).expect["guarantee.few.violations"].share == 0.5


@pytest.mark.parametrize("share", [0, 1, -0.2, 1.5])
def test_a_share_that_no_campaign_could_show_is_refused(beacons: Path, share: float) -> None:
    with pytest.raises(ScenarioError, match="expected more than 0 and less than 1, the share of a campaign's runs"):
        load(beacons, overrides=[f"expect.delivery_ratio.share={share}"])
