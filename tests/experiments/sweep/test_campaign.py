"""Campaigns: the figures of single runs, nothing twice and nothing lost, one clear line for what cannot be run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import pyarrow.parquet as pq
import pytest

from experiments.judge.campaign import JOURNAL, load_campaign
from experiments.run.run_folder import FolderTaken
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from experiments.show.console import PlainConsole
from experiments.sweep.campaign import Wanted, sweep
from experiments.sweep.command import MOST_COMMANDS, run_sweep
from experiments.sweep.messages import Point, Source
from experiments.sweep.vary import BadCampaign, parse
from experiments.sweep.workers import Workers
from tests.processes import alive, children

MARCONET = [sys.executable, "-m", "marconet.command_line"]
LOSS = "impairments[0].loss_ratio"


def wanted(scenario: Path, out: Path, *vary: str, **options: Any) -> Wanted:
    return Wanted(Source.of(scenario), [parse(text) for text in vary], out=out,
                  **{"jobs": 1, "folders": 0, "seeds": 2} | options)


def wait_for(condition: Callable[[], object], within_s: float = 60.0) -> None:
    end_s = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < end_s, "it has not happened"
        time.sleep(0.01)


def test_a_run_of_a_campaign_has_the_hash_and_the_figures_of_a_single_run(beacons: Path, tmp_path: Path) -> None:
    swept = sweep(wanted(beacons, tmp_path / "out", f"{LOSS}=0.0,0.4", jobs=2))

    table = pq.read_table(tmp_path / "out" / "runs.parquet").to_pylist()
    assert [(row[LOSS], row["seed"]) for row in table] == [(0.0, 7), (0.0, 8), (0.4, 7), (0.4, 8)]
    for row in table:
        alone = run(load(beacons, seed=row["seed"], values={LOSS: row[LOSS]}), host="inline",
                    out=tmp_path / f"{row['number']}", report=False).summary
        assert row["ledger_hash"] == alone.ledger_hash
        assert {key: row[key] for key in ("delivery_ratio", "count.a.heard")} == {
            verdict.key: verdict.value for verdict in alone.verdicts}
        assert row["holds"] == alone.holds
    assert len({row["ledger_hash"] for row in table}) > 2
    assert sorted(file.name for file in swept.folder.iterdir()) == ["campaign.json", "report.html", "runs.parquet"]


@pytest.mark.parametrize("scenario", [pytest.param("output_sync", marks=pytest.mark.slow), "tracking_individual"])
def test_scenarios_of_the_library_have_the_hash_and_the_figures_of_a_single_run(scenario: str, tmp_path: Path) -> None:
    from experiments.scenario import find

    source = Source.of(find(scenario), length_s=0.5)

    with Workers(source, "inline", 1) as workers:
        found = [figures for _, figures in workers.evaluate(Point(seed, {}, seed) for seed in (3, 4))]

    for figures in found:
        alone = run(load(find(scenario), seed=figures.seed, duration_s=0.5), host="inline",
                    out=tmp_path / f"{figures.seed}", report=False).summary
        assert (figures.ledger_hash, figures.values) == (
            alone.ledger_hash, {verdict.key: verdict.value for verdict in alone.verdicts})


@pytest.mark.slow
def test_with_processes_the_figures_are_those_of_an_inline_run(beacons: Path) -> None:
    found = {}
    for host in ("inline", "process"):
        with Workers(Source.of(beacons), host, 1) as workers:       # type: ignore[arg-type]
            found[host] = next(iter(workers.evaluate([Point(0, {}, 7)])))[1]

    assert found["inline"].ledger_hash == found["process"].ledger_hash
    assert found["inline"].values == found["process"].values


def test_the_command_lists_runs_by_number_and_says_how_many_more_do_not_hold(
        beacons: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = run_sweep(
        PlainConsole(), str(beacons), ['agents.b.parameters.ends="","raises"'], verbose=False, as_json=False,
        sample=None, runs=None, seeds=12, seed=None, duration_s=None, overrides=['expect."count.a.heard"={max=5}'],
        host="inline", jobs=1, cluster="", resume=False, out=tmp_path / "out", folders=0)

    said = capsys.readouterr().out.splitlines()
    listed = [int(line.split()[1]) for line in said if line.startswith("run ") and "marconet run" in line]
    assert code == 3
    assert set(listed) > set(range(12, 12 + MOST_COMMANDS))     # those that failed, and the worst of each figure
    assert listed == sorted(listed)
    assert f"and {24 - len(listed)} more that do not hold: see the report, or runs.parquet for all" in said


@pytest.mark.slow
def test_a_run_that_fails_is_a_row_with_its_reason_and_is_repeated_with_its_records(
        beacons: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    swept = sweep(wanted(beacons, Path("out"), 'agents.b.parameters.ends="","raises","killed"', seeds=1,
                         folders=3))

    rows = pq.read_table(tmp_path / "out" / "runs.parquet").to_pylist()
    assert [row["holds"] for row in rows] == [True, False, False]
    assert "no fuel" in rows[1]["failure"]
    assert "killed by SIGKILL" in rows[2]["failure"]
    assert set(swept.repeated) == {0, 1, 2}
    for number in (1, 2):
        assert (swept.repeated[number] / "report.html").is_file()
        assert msgspec.json.decode((swept.repeated[number] / "summary.json").read_bytes())["failure"]
    assert 'href="runs/1-7/report.html"' in swept.report.read_text()
    command = next(command for row, command in swept.commands(5) if row.number == 1)
    assert command == (f"marconet run {beacons} --seed 7 --host inline --set "
                       "'agents.b.parameters.ends=\"raises\"'")


@pytest.mark.parametrize(("vary", "problem"), [
    ("impairments[0].loss_rati=0.1,0.2", "unknown key; did you mean \"loss_ratio\"?"),
    (f"{LOSS}=0.1,7", "loss_ratio=7.0: expected 0 <= loss_ratio < 1"),
    ("media.radi.preset=1,2", "media has no \"radi\"; did you mean"),
])
def test_a_bad_key_or_value_is_told_in_the_loaders_words_before_any_run(beacons: Path, tmp_path: Path, vary: str,
                                                                        problem: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        sweep(wanted(beacons, tmp_path / "out", vary))

    assert len(refused.value.problems) == 1
    assert problem.replace('"', "") in refused.value.problems[0].replace('"', "").replace("'", "")
    assert not (tmp_path / "out").exists()


def test_no_run_and_no_job_are_refused(beacons: Path, tmp_path: Path) -> None:
    with pytest.raises(BadCampaign, match="--seeds 0: a campaign of no run"):
        sweep(wanted(beacons, tmp_path / "out", seeds=0))
    with pytest.raises(BadCampaign, match="--jobs 0: expected at least 1"):
        sweep(wanted(beacons, tmp_path / "out", jobs=0))


def test_a_campaign_goes_on_where_it_was_and_may_have_more_seeds(beacons: Path, tmp_path: Path) -> None:
    sweep(wanted(beacons, tmp_path / "out", f"{LOSS}=0.1,0.2", seeds=2))
    first = {(row.setting, row.seed): row.figures for row in load_campaign(tmp_path / "out").rows}
    ran: list[int] = []

    sweep(wanted(beacons, tmp_path / "out", f"{LOSS}=0.1,0.2", seeds=3, resume=True),
          lambda ended, total, broken: ran.append(ended))

    rows = {(row.setting, row.seed): row.figures for row in load_campaign(tmp_path / "out").rows}
    assert ran == [4, 5, 6]
    assert {place: rows[place] for place in first} == first        # with their processor times: they did not run again
    assert set(rows) == {(setting, seed) for setting in (0, 1) for seed in (7, 8, 9)}


@pytest.mark.slow
def test_another_campaign_is_not_gone_on_with(beacons: Path, tmp_path: Path) -> None:
    sweep(wanted(beacons, tmp_path / "out", f"{LOSS}=0.1,0.2"))

    with pytest.raises(FolderTaken, match="holds a campaign: go on with it by --resume"):
        sweep(wanted(beacons, tmp_path / "out", f"{LOSS}=0.1,0.2"))
    with pytest.raises(BadCampaign, match="holds another campaign: its 2 settings had other values"):
        sweep(wanted(beacons, tmp_path / "out", f"{LOSS}=0.1,0.3", resume=True))
    with pytest.raises(BadCampaign, match="its seeds were 7 to 8, now 7 to 7"):
        sweep(wanted(beacons, tmp_path / "out", f"{LOSS}=0.1,0.2", resume=True, seeds=1))
    beacons.write_text(beacons.read_text() + "\n")
    with pytest.raises(BadCampaign, match=r"the file of beacons has changed since; name another folder"):
        sweep(wanted(beacons, tmp_path / "out", f"{LOSS}=0.1,0.2", resume=True))
    with pytest.raises(FileExistsError, match="holds something else than a campaign"):
        sweep(wanted(beacons, beacons.parent))


def command(scenario: Path, out: Path, *more: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*MARCONET, "sweep", str(scenario), "--out", str(out), "--jobs", "2", "--seeds", "40", "--folders", "0",
         "--set", "agents.b.parameters.wall_ms=2.0", *more], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        start_new_session=True)


def kept(out: Path) -> int:
    return len(load_campaign(out).rows) if (out / JOURNAL).exists() else 0


@pytest.mark.slow
def test_after_a_kill_nothing_is_run_twice_and_no_worker_is_left(beacons: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with command(beacons, out) as killed:
        wait_for(lambda: kept(out) >= 5)
        workers = children(killed.pid)
        killed.kill()
    wait_for(lambda: not any(map(alive, workers)))
    before = {row.number: row for row in load_campaign(out).rows}

    with command(beacons, out, "--resume") as resumed:
        told, errors = resumed.communicate(timeout=300)

    assert (resumed.returncode, errors) == (0, ""), told
    after = {row.number: row for row in load_campaign(out).rows}
    assert len(workers) == 2
    assert 5 <= len(before) < 40
    assert sorted(after) == list(range(40))
    assert {number: after[number] for number in before} == before      # with their processor times
    assert not (out / JOURNAL).exists()


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_no_run(beacons: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with command(beacons, out) as running:
        wait_for(lambda: kept(out) >= 3)
        os.kill(children(running.pid)[0], signal.SIGKILL)
        told, errors = running.communicate(timeout=300)

    assert (running.returncode, errors) == (0, ""), told
    assert [row.number for row in load_campaign(out).rows] == list(range(40))
    assert all(row.figures.ledger_hash for row in load_campaign(out).rows)


@pytest.mark.slow
def test_ctrl_c_keeps_what_has_ended_and_ends_all_workers(beacons: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with command(beacons, out) as running:
        wait_for(lambda: kept(out) >= 3)
        workers = children(running.pid)
        os.killpg(running.pid, signal.SIGINT)
        _, errors = running.communicate(timeout=120)

    assert running.returncode == 130
    assert errors.splitlines() == ["interrupted (SIGINT)", f"what was recorded: {out}"]
    assert not any(map(alive, workers))
    assert 3 <= pq.read_table(out / "runs.parquet").num_rows < 40
    assert "runs are missing: the campaign was interrupted" in (out / "report.html").read_text()


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 1 MB in memory."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "marconet-test", str(place)],
                             capture_output=True, text=True, check=False)
    if mounted.returncode:
        pytest.skip(f"a small tmpfs cannot be mounted here, which root may do: {mounted.stderr.strip()}")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


@pytest.mark.slow
def test_on_a_full_disk_what_has_ended_is_kept_and_told_in_one_line(beacons: Path, small_disk: Path) -> None:
    out = small_disk / "out"
    with command(beacons, out) as running:
        wait_for(lambda: kept(out) >= 3)
        with suppress(OSError), (small_disk / "filler").open("wb", buffering=0) as filler:
            while filler.write(bytes(512)):
                pass
        _, errors = running.communicate(timeout=120)
    rows = load_campaign(out).rows

    assert running.returncode == 2
    assert errors.splitlines()[0] == (f"{out}: cannot keep the results: No space left on device: free space, then go "
                                      f"on with --resume; {len(rows)} of 40 runs are kept")
    assert 3 <= len(rows) < 40


@pytest.mark.slow
def test_a_folder_in_use_is_refused(beacons: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with command(beacons, out) as running:
        wait_for(lambda: kept(out) >= 1)
        with pytest.raises(FolderTaken, match="runs a scenario into it"):
            sweep(wanted(beacons, out, resume=True))
        running.terminate()
        running.communicate(timeout=120)


@pytest.mark.slow
def test_runs_without_end_need_no_more_memory(beacons: Path) -> None:
    def private_kb(pid: int) -> int:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
        return sum(int(line.split()[1]) for line in lines if line.startswith("Private_"))

    with Workers(Source.of(beacons, length_s=0.05), "inline", 1) as workers:
        sizes = []
        for number, _ in enumerate(workers.evaluate(Point(seed, {}, seed) for seed in range(600))):
            if number in (200, 599):
                sizes.append(private_kb(workers.pids[0]))

    # 400 runs; one that kept its 20 frames alone would add 400 * 20 * 0.5 kB = 4 MB
    assert sizes[1] - sizes[0] < 1000


def test_faults_at_random_times_are_drawn_anew_for_each_seed(beacons: Path, tmp_path: Path) -> None:
    beacons.write_text(beacons.read_text() + '\n[[faults]]\nkind = "kill"\non = "b"\nrate_per_s = 4.0\n'
                       "restart_after_s = 0.05\n")

    sweep(wanted(beacons, tmp_path / "out", seeds=4))

    rows = pq.read_table(tmp_path / "out" / "runs.parquet").to_pylist()
    alone = [run(load(beacons, seed=row["seed"]), host="inline", out=tmp_path / str(row["seed"]),
                 report=False).summary.ledger_hash for row in rows]
    assert [row["ledger_hash"] for row in rows] == alone
    assert len({row["count.a.heard"] for row in rows}) > 1
