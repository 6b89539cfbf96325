"""Impairments with a time window, run: nothing is overtaken at its end, no copy is missing; a name keeps its draws."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as parquet
import pytest

from experiments.run.runner import run
from experiments.scenario import ScenarioError, load

CASES = Path(__file__).parents[1] / "cases" / "window_end"
TWICE = """\
seed = 2
length_s = 1.0
[agents.a]
program = "beacon:Beacon"
parameters = { period_ms = 10, bytes = 30 }
[agents.b]
program = "beacon:Ear"
[media.radio]
kind = "broadcast_radio"
topology = { kind = "fixed", links = ["a -> b"] }
"""
LOSS = '[[impairments]]\non = "radio: a -> b"\nkind = "bernoulli_loss"\nloss_ratio = 0.5\n'
CORRUPT = '[[impairments]]\non = "radio: a -> b"\nkind = "corrupt"\nframe_ratio = 0.01\n'


@pytest.fixture
def lost(tmp_path):
    """The frames that the loss of a scenario with these impairments loses, with their causes."""

    def frames(impairments: str, folder: str) -> list[tuple[int, str]]:
        place = tmp_path / folder
        place.mkdir()
        (place / "beacon.py").write_text((CASES / "beacon.py").read_text())
        (place / "twice.toml").write_text(TWICE + impairments)
        run(load(place / "twice.toml"), host="inline", out=place / "run", report=False)
        rows = parquet.read_table(place / "run" / "ledger.parquet").to_pylist()
        return [(row["number"], row["cause"]) for row in rows if row["fate"] == "lost"]

    return frames


@pytest.mark.parametrize(("case", "frames"), [("rate", 600), ("keep", 200)])
def test_nothing_overtakes_when_a_window_ends_and_no_copy_is_missing(case, frames, tmp_path):
    run(load(CASES / f"{case}.toml"), host="inline", out=tmp_path / "run", report=False)

    rows = parquet.read_table(tmp_path / "run" / "ledger.parquet").to_pylist()      # of one link, in order of sending
    arrivals_ns = [row["delivered_ns"] for row in sorted(rows, key=lambda row: row["number"])
                   if row["delivered_ns"] is not None]
    assert arrivals_ns == sorted(arrivals_ns)
    assert len(rows) == frames


def test_a_queue_drains_at_its_rate_after_the_window_and_later_copies_follow_its_last_one(tmp_path):
    """By Lindley's recursion: 100 frames of 30 bytes, one every 10 ms, take 25 ms each; the queue is empty at 2.5 s."""
    run(load(CASES / "rate.toml"), host="inline", out=tmp_path / "run", report=False)

    rows = parquet.read_table(tmp_path / "run" / "ledger.parquet").to_pylist()
    delivered_ns = {row["number"]: row["delivered_ns"] for row in rows}
    first_ns = delivered_ns[0] - 25_000_000                             # when frame 0 entered the link
    last_ns = first_ns + 100 * 25_000_000
    assert [delivered_ns[k] for k in range(100)] == [first_ns + (k + 1) * 25_000_000 for k in range(100)]
    assert all(delivered_ns[k] == max(last_ns, first_ns + k * 10_000_000) for k in range(100, 500))


def test_a_named_impairment_draws_the_same_wherever_it_stands(lost):
    named = LOSS + 'name = "door"\n'

    first, second = lost(named, "first"), lost(CORRUPT + named, "second")

    assert first == second
    assert {cause for _, cause in first} == {"door bernoulli_loss"}
    assert lost(LOSS + 'name = "gate"\n', "third") != first


def test_an_impairment_without_a_name_draws_by_its_place(lost):
    first, second = lost(LOSS, "first"), lost(CORRUPT + LOSS, "second")

    assert [frame for frame, _ in first] != [frame for frame, _ in second]
    assert {cause for _, cause in first} == {"impairments[0] bernoulli_loss"}


@pytest.mark.parametrize(("impairments", "problem"), [
    (LOSS + 'name = "door"\n' + LOSS + 'name = "door"\n',
     'impairments[1].name="door": the name of impairments[0] too, so both would draw the same; give each a name'),
    (LOSS + 'name = "impairments[1]"\n', "impairments[0].name: "),
    (LOSS + "name = 3\n", "impairments[0].name=3: expected text in quotes"),
    (LOSS + 'nane = "door"\n', 'impairments[0].nane="door": unknown key; did you mean "name"?'),
])
def test_a_name_that_cannot_stand_for_one_stream_is_refused(impairments, problem, tmp_path):
    (tmp_path / "beacon.py").write_text((CASES / "beacon.py").read_text())
    (tmp_path / "few.toml").write_text(TWICE + impairments)

    with pytest.raises(ScenarioError) as refusal:
        load(tmp_path / "few.toml")

    line, = refusal.value.problems
    assert problem in line
