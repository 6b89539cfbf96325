"""`marconet shrink` on real runs: the faults and losses that matter, the length, and what cannot be made smaller."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from experiments.search.shrink import CannotShrink, shrink
from netem.wire.errors import NodeFailure


def recorded(scenario: Path, out: Path, **changes: object) -> Path:
    run(load(scenario, values=changes), host="inline", out=out, report=False)
    return out


def test_of_forty_faults_the_two_that_matter_are_left_within_sixty_runs(forty_faults: Path, tmp_path: Path) -> None:
    folder = recorded(forty_faults, tmp_path / "run")

    shrunk = shrink(folder)

    assert len(shrunk.items) == 40
    assert shrunk.lines == ["pause of a at 1.2 s", "pause of b at 3.1 s"]
    assert shrunk.runs <= 60
    assert shrunk.minimal
    # The watch closes round 31 at 3.14 s; the length is found to 5 % of the run.
    assert 3.14e9 < shrunk.length_ns < 3.14e9 + 2 * 0.05 * 4.5e9
    small = load(shrunk.file)
    assert [(fault.kind, *fault.targets, *fault.occurrences) for fault in small.faults] == [
        ("pause", ("a",), (1_200_000_000, 1_270_000_000)), ("pause", ("b",), (3_100_000_000, 3_170_000_000))]
    again = run(small, host="inline", out=tmp_path / "again", report=False).summary
    assert [(verdict.key, verdict.holds) for verdict in again.verdicts] == [("count.c.split", False)]


def test_drawn_losses_become_the_few_frames_that_matter(watched: Path, tmp_path: Path) -> None:
    text = watched.read_text().replace('"count.c.split" = { max = 0 }', "max_successive_losses = { max = 3 }")
    watched.write_text(text + '[[impairments]]\non = "radio: * -> *"\nkind = "gilbert_elliott"\nloss_ratio = 0.3\n'
                              'mean_burst_frames = 3.0\n[[impairments]]\non = "radio: a -> c"\nkind = "delay"\n'
                              'delay_ms = 1\n')
    folder = recorded(watched, tmp_path / "run")

    shrunk = shrink(folder)

    # Four losses in a row on one link break it, and nothing else: not the delay, and no fault.
    small = load(shrunk.file)
    (spec,) = small.impairments
    lost = spec.fields["lose_frames"]
    assert (spec.kind, lost) == ("scripted_loss", list(range(lost[0], lost[0] + 4)))
    assert len(shrunk.items) > 20
    again = run(small, host="inline", out=tmp_path / "again", report=False).summary
    assert again.verdicts[0].value == 4


def test_a_run_that_failed_fails_by_the_same_error(forty_faults: Path, tmp_path: Path) -> None:
    changes = {"agents.c.parameters.raises": True}
    with pytest.raises(NodeFailure, match="split at"):
        recorded(forty_faults, tmp_path / "run", **changes)

    shrunk = shrink(tmp_path / "run")

    assert shrunk.expectation == ""
    assert shrunk.lines == ["pause of a at 1.2 s", "pause of b at 3.1 s"]
    with pytest.raises(NodeFailure, match="split at"):
        run(load(shrunk.file), host="inline", out=tmp_path / "again", report=False)


def test_a_figure_that_is_small_because_the_run_is_short_does_not_shorten_it(watched: Path, tmp_path: Path) -> None:
    """45 beacons are heard of each; one loss breaks the bound, and a shorter run breaks it without any."""
    watched.write_text(watched.read_text().replace("{ min = 10 }", "{ min = 90 }") +
                       '[[impairments]]\non = "radio: a -> c"\nkind = "scripted_loss"\nlose_frames = [5, 9]\n')
    folder = recorded(watched, tmp_path / "run")

    shrunk = shrink(folder)

    assert shrunk.length_ns == shrunk.full_length_ns == 4_500_000_000
    assert len(shrunk.kept) == 1


def test_faults_at_random_times_are_written_at_their_instants(watched: Path, tmp_path: Path) -> None:
    watched.write_text(watched.read_text().replace("{ min = 10 }", "{ min = 85 }") +
                       '[[faults]]\nkind = "kill"\non = "[ab]"\nrate_per_s = 2.0\nrestart_after_s = 0.3\n')
    folder = recorded(watched, tmp_path / "run")

    shrunk = shrink(folder)

    drawn = {start for fault in load(watched).faults for start, _ in fault.occurrences}
    kept = [start for fault in load(shrunk.file).faults for start, _ in fault.occurrences]
    assert 0 < len(kept) < len(drawn)
    assert set(kept) <= drawn


def test_drawn_delays_become_those_of_the_few_frames_that_matter(watched: Path, tmp_path: Path) -> None:
    """The delay behind the losses draws by its place in the list; one of more than 20 ms misses the round."""
    before = '[[impairments]]\non = "radio: a -> b"\nkind = "bernoulli_loss"\nloss_ratio = 0.9\n'
    delay = ('[[impairments]]\non = "radio: * -> c"\nkind = "delay"\ndelay_ms = 0\njitter_ms = 28\n'
             'distribution = "uniform"\n')
    text = watched.read_text().replace('"count.c.split" = { max = 0 }', '"c.missed.last" = { max = 1e6 }')

    def missed(rest: str) -> float:
        watched.write_text(text + rest)
        with TemporaryDirectory() as out:
            verdicts = run(load(watched), host="inline", out=Path(out) / "run", report=False).summary.verdicts
        return next(verdict.value or 0.0 for verdict in verdicts if verdict.key == "c.missed.last")

    second, first = missed(before + delay), missed(delay)
    assert second > first                               # by the scenario's seed
    text = text.replace("max = 1e6", f"max = {second - 0.5}")
    watched.write_text(text + before + delay)
    folder = recorded(watched, tmp_path / "run")

    shrunk = shrink(folder)

    small = load(shrunk.file)
    assert {spec.kind for spec in small.impairments} == {"scripted_delay"}
    late = {(link[1], frame): delay_ns for spec in small.impairments for link in spec.links
            for frame, delay_ns in zip(spec.fields["delay_frames"], spec.fields["delays_ns"], strict=True)}
    # Exactly as many rounds as break the bound, each missed by a delay that was drawn.
    assert len(late) == len(shrunk.kept) == round(second)
    assert all(20_000_000 - 1_000_000 < delay_ns <= 28_000_000 for (name, _), delay_ns in late.items() if name == "b")
    assert len(shrunk.items) > 80
    again = run(small, host="inline", out=tmp_path / "again", report=False).summary
    assert again.verdicts[0].value == second


def test_a_run_in_which_all_holds_is_refused(watched: Path, tmp_path: Path) -> None:
    folder = recorded(watched, tmp_path / "run")

    with pytest.raises(CannotShrink, match="every expectation holds, so there is no failure to make smaller"):
        shrink(folder)
    with pytest.raises(CannotShrink, match=r"name the folder of a run"):
        shrink(tmp_path)


def test_a_run_needs_nothing_but_its_folder_and_the_file_as_it_was(forty_faults: Path, tmp_path: Path) -> None:
    folder = recorded(forty_faults, tmp_path / "run", **{"agents.c.parameters.bias": 0.5, "length_s": 4.2, "seed": 9})

    shrunk = shrink(folder, most_runs=3)
    forty_faults.write_text(forty_faults.read_text().replace("raises = false", "raises = true"))

    assert (shrunk.runs, shrunk.full_length_ns) == (3, 4_200_000_000)
    small = load(shrunk.file)
    assert (small.seed, small.agents["c"].parameters["bias"]) == (9, 0.5)
    with pytest.raises(CannotShrink, match=r"agents\.c\.parameters\.raises is not what watched\.toml says now: run the "
                                           "file again, as it has changed since"):
        shrink(folder)


def test_the_explicit_form_that_holds_is_told_in_one_line(forty_faults: Path, tmp_path: Path) -> None:
    folder = recorded(forty_faults, tmp_path / "run")
    program = forty_faults.with_name("watch.py")
    program.write_text(program.read_text().replace('("a", 12)', '("a", 1300)'))

    told = subprocess.run([sys.executable, "-m", "marconet.command_line", "shrink", str(folder), "--quiet"],
                          capture_output=True, text=True, check=False)

    assert told.returncode == 2
    assert told.stderr.startswith("watched.toml: with every drawn fault and loss written out (40 entries), expectation "
                                  "count.c.split holds: count.c.split = 0")
    assert len(told.stderr.splitlines()) == 1


def test_when_the_runs_are_used_up_the_smallest_so_far_is_written(forty_faults: Path, tmp_path: Path) -> None:
    folder = recorded(forty_faults, tmp_path / "run")

    shrunk = shrink(folder, most_runs=12, out=forty_faults.with_name("smaller.toml"))

    assert not shrunk.minimal
    assert shrunk.runs == 12
    assert 2 < len(shrunk.kept) < 40
    assert not run(load(shrunk.file), host="inline", out=tmp_path / "again", report=False).summary.holds


def test_a_scenario_that_would_not_find_its_programs_is_not_written_there(forty_faults: Path, tmp_path: Path) -> None:
    folder = recorded(forty_faults, tmp_path / "run")

    with pytest.raises(ValueError, match=r"does not load from there: .*: name a file in"):
        shrink(folder, out=tmp_path / "elsewhere" / "small.toml")


def test_a_run_whose_scenario_is_gone_is_told(forty_faults: Path, tmp_path: Path) -> None:
    folder = recorded(forty_faults, tmp_path / "run")
    forty_faults.unlink()

    with pytest.raises(ScenarioError, match=r"the scenario of this run, .*watched\.toml, is no file"):
        shrink(folder)
