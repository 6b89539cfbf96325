"""Fades that last seconds and impairments that links share, in runs: the cases `ge_time` and `gemodel4`."""

from __future__ import annotations

from itertools import groupby, pairwise
from math import sqrt
from pathlib import Path
from statistics import mean

import pyarrow.parquet as parquet
import pytest

from experiments.run.runner import run
from experiments.scenario import ScenarioError, load

CASES = Path(__file__).parents[1] / "cases"
BURST, FULL = CASES / "ge_time" / "burst.toml", CASES / "gemodel4" / "full.toml"
FADES = '{on="radio: * -> base", kind="gilbert_elliott_by_time", mean_good_s=8.0, mean_bad_s=2.0'


@pytest.fixture
def lost_of(tmp_path):
    """By sender, (instant [ns], whether the copy was lost) of each frame, in order of time."""

    def lost(source, host="inline", **changes):
        folder = tmp_path / f"run{len(list(tmp_path.iterdir()))}"
        run(load(source, **changes), host=host, out=folder, report=False)
        rows = sorted(parquet.read_table(folder / "ledger.parquet").to_pylist(), key=lambda row: row["offered_ns"])
        return {sender: [(row["offered_ns"], row["fate"] == "lost") for row in rows if row["sender"] == sender]
                for sender in {row["sender"] for row in rows}}

    return lost


def fades_s(frames):
    """The lengths of the stretches in which every frame is lost, from the first of them to the next one that is not."""
    starts = [(bad, next(group)[0]) for bad, group in groupby(frames, key=lambda frame: frame[1])]
    return [(end_ns - start_ns) / 1e9 for (bad, start_ns), (_, end_ns) in pairwise(starts) if bad]


@pytest.mark.slow
def test_a_fade_lasts_as_long_for_a_robot_at_1_hz_as_for_one_at_100_hz(lost_of):
    lost = lost_of(BURST, overrides=[f"impairments=[{FADES}}}]"])

    fast, slow = fades_s(lost["fast"]), fades_s(lost["slow"])
    assert abs(mean(fast) - 2.0) < 4 * 2.0 / sqrt(len(fast))        # the deviation of an exponential is its mean
    # Sampled every 1 s, a fade seen has a geometric number of frames; P(BAD 1 s later | BAD) = s + (1 - s) e^-0.625.
    stays = 0.2 + 0.8 * 0.5353
    assert abs(mean(slow) - 1 / (1 - stays)) < 4 * sqrt(stays) / (1 - stays) / sqrt(len(slow))
    for sender, frames in lost.items():
        share = mean(bad for _, bad in frames)
        assert abs(share - 0.2) < 4 * sqrt(0.2 * 0.8 * 2 * 1.6 / 2000), sender      # correlation time 1.6 s in 2000 s


@pytest.mark.slow
def test_robots_that_share_a_fade_are_deaf_at_the_same_time_and_a_third_one_changes_nothing(lost_of):
    shared = [f"impairments=[{FADES}, shared=true}}]"]

    lost = lost_of(BURST, overrides=shared, duration_s=300.0)
    again = lost_of(BURST, "process", duration_s=300.0, overrides=[
        shared[0].replace("radio: * -> base", "radio: slow -> base")])

    fast, slow = dict(lost["fast"]), dict(lost["slow"])
    around = [(fast[at_ns - 5_000_000], bad, fast[at_ns + 5_000_000]) for at_ns, bad in slow.items()
              if at_ns + 5_000_000 in fast]
    assert len(around) > 290
    assert all(bad in (before, after) for before, bad, after in around)         # 10 ms apart: at most one edge
    assert len({bad for _, bad, _ in around}) == 2
    assert again["slow"] == lost["slow"]
    assert not any(bad for _, bad in again["fast"])


def test_netems_four_numbers_can_be_said(lost_of):
    frames = lost_of(FULL, duration_s=400.0)["a"]

    memory = 1 - 0.2 - 0.2 * (0.09 / 0.89) / (0.8 / 0.89)               # of the chain: 1 - p_leave - p_enter
    sigma = sqrt(0.1 * 0.9 / len(frames) * (1 + memory) / (1 - memory))
    assert abs(mean(bad for _, bad in frames) - 0.1) < 4 * sigma


@pytest.mark.parametrize(("impairment", "says"), [
    (f"{FADES}, shared=1}}", "impairments[0].shared=1: expected true or false"),
    (f"{FADES}, mean_burst_frames=3.0}}", "impairments[0].mean_burst_frames=3.0: unknown key"),
    ('{on="radio: * -> base", kind="gilbert_elliott_by_time", mean_good_s=8.0}',
     "impairments[0].mean_bad_s: is missing"),
    ('{on="radio: * -> base", kind="gemodel", p=2.0}', "impairments[0].p=2.0: expected 0 <= p <= 1"),
    ('{on="radio: * -> base", kind="rate_limit", rate_bps=9600, queue_ms=-1}',
     "impairments[0].queue_ms=-1 (queue_ns=-1000000): expected queue_ns >= 0"),
])
def test_mistakes_are_told_with_their_place(impairment, says):
    with pytest.raises(ScenarioError) as refusal:
        load(BURST, overrides=[f"impairments=[{impairment}]"])

    assert any(says in line for line in refusal.value.problems), refusal.value.problems
