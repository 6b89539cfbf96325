"""What a run says to expectations that hold by accident, on what newcomers brought."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.judge.run_result import RunResult, Verdict
from experiments.run.runner import run
from experiments.scenario import ScenarioError, find, load

CASES = Path(__file__).parents[2] / "cases"


def ran(case: str, out: Path, *overrides: str, rename: tuple[str, str] | None = None) -> RunResult:
    source = CASES / case
    if rename:
        source = out.parent / source.name
        source.write_text((CASES / case).read_text(encoding="utf-8").replace(*rename), encoding="utf-8")
        (out.parent / "beacon.py").write_text((CASES / case).with_name("beacon.py").read_text(encoding="utf-8"))
    return run(load(source, overrides=overrides), host="inline", out=out, report=False)


def verdicts(result: RunResult) -> dict[str, Verdict]:
    return {verdict.key: verdict for verdict in result.summary.verdicts}


def test_the_mean_age_of_a_link_that_never_delivers_is_half_the_run(tmp_path: Path) -> None:
    found = verdicts(ran("mean_age/age.toml", tmp_path / "run"))

    assert found["radio.age_of_information_mean_s"].value == 10.0           # worst of r1 -> r2, over 20 s
    assert not found["radio.age_of_information_mean_s"].holds
    assert found["radio.age_of_information_max_s"].value == 20.0


def test_a_key_for_one_fate_cannot_be_taken_for_all_that_was_not_delivered(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as refused:
        load(CASES / "frames_lost" / "all_deaf.toml")

    assert refused.value.problems == [
        f"all_deaf.toml: expect.{key}: counts only what an impairment dropped, one fate of many; write "
        f"frames_lost_on_link for that, or frames_not_delivered for all copies that did not arrive"
        for key in ("frames_lost", "radio.frames_lost")]
    found = verdicts(ran("frames_lost/all_deaf.toml", tmp_path / "run", rename=("frames_lost", "frames_not_delivered")))
    assert [(verdict.value, verdict.holds) for verdict in found.values()] == [(400.0, False)] * 2


def test_an_expectation_on_a_misspelt_counter_does_not_hold_and_names_the_nearest(tmp_path: Path) -> None:
    found = verdicts(ran("novice/e13_expectcounter.toml", tmp_path / "run", "expect.'count.r1.herd'={ max = 0 }"))

    assert not found["count.r1.herd"].holds
    assert found["count.r1.herd"].by_how_much() == (
        "no node that matches 'r1' has a counter 'herd'; nearest: count.r1.heard; if its program may count nothing, "
        "let it declare the counter at its start: board.count('herd', 0)")


@pytest.mark.parametrize(("section", "says"), [
    ('[expect]\n"r1.herd.max" = { min = 1 }',
     "expect.r1.herd.max: no node that matches 'r1' has a signal 'herd'; nearest: r1.heard.max"),
    ("[derived.both]\nfunction = 'both:both'\nof = ['r1.heard', 'r2.herd']\nsignals = { both = '1' }\n[expect]",
     'derived.both.of[1]="r2.herd": r2 records no such signal; did you mean "heard"?')])
def test_a_signal_that_no_node_records_is_refused_before_the_first_instant(tmp_path: Path, section: str,
                                                                          says: str) -> None:
    (tmp_path / "both.py").write_text("def both(one, other):\n    return one + other\n")

    with pytest.raises(ScenarioError) as refused:
        ran("novice/e13_expectcounter.toml", tmp_path / "run", rename=("[expect]", section))

    assert refused.value.problems == [f"e13_expectcounter.toml: {says}"]


def test_counters_of_programs_and_media_that_come_with_marconet_hold_at_0(tmp_path: Path) -> None:
    counters = ("fallbacks", "unreadable frames", "incomplete discoveries", "refused control frames")
    scenario = load(find("output_sync"), duration_s=0.2, overrides=[
        f"expect={{{', '.join(f'{chr(34)}count.*.{name}{chr(34)} = {{ max = 0 }}' for name in counters)}}}"])
    found = run(scenario, host="inline", out=tmp_path, report=False)

    assert [(verdict.value, verdict.holds) for verdict in found.summary.verdicts] == [(0.0, True)] * len(counters)


def test_a_formula_is_judged_by_its_robustness_with_the_instant_that_decides(tmp_path: Path) -> None:
    (tmp_path / "beacon.py").write_text((CASES / "mean_age" / "beacon.py").read_text(encoding="utf-8"))
    source = tmp_path / "age.toml"
    text = (CASES / "mean_age" / "age.toml").read_text(encoding="utf-8")
    source.write_text(text.replace("[expect]", """[expect]
fresh = "always age(radio: r1 -> r2) < 5 s"
old = { formula = "always age(radio: r1 -> r2) < 5 s", min = -15, max = -14 }"""))

    result = run(load(source), host="inline", out=tmp_path / "run", report=True)

    found = verdicts(result)
    fresh = found["fresh"]
    assert (fresh.value, fresh.unit, fresh.at_ns, fresh.predicate) == (
        -15.0, "s", 20_000_000_000, "age(radio: r1 -> r2) < 5 s")               # nothing arrives in 20 s
    assert fresh.by_how_much() == "violated by 15 s, decided at 20 s by age(radio: r1 -> r2) < 5 s"
    assert not fresh.holds
    assert found["old"].holds
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert 'data-t="20.000000000" data-words="age(radio: r1 -&gt; r2) &lt; 5 s"' in page
