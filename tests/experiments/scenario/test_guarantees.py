"""`[guarantees.NAME]`: what is read, what it means for `[expect]`, and each mistake in one line."""

from __future__ import annotations

import pytest

from experiments.scenario import ScenarioError, load

STATED = """
[guarantees.fresh]
kind = "age_of_information"
on = "radio: r1 -> r2"
below_ms = 50
[guarantees.losses]
kind = "successive_losses"
on = "radio: * -> *"
at_most = 1
expected = "violated"
[guarantees.no_zeno]
kind = "inter_transmission_time"
on = "radio: r*"
at_least_us = 17
[guarantees.small_gain]
kind = "signal"
on = "r1.gain"
below = 1.0
[guarantees.told]
kind = "reported"
on = "r2.gain product"
below = 1
above = -1
"""


def test_a_guarantee_is_read_with_its_links_and_its_times_in_nanoseconds(valid, write):
    guarantees = load(write(valid + STATED)).guarantees

    assert list(guarantees) == ["fresh", "losses", "no_zeno", "small_gain", "told"]
    assert (guarantees["fresh"].kind, guarantees["fresh"].fields) == ("age_of_information", {"below_ns": 50_000_000})
    assert guarantees["losses"].subjects == (("radio", "r1", "r2"), ("radio", "r2", "r1"))
    assert guarantees["no_zeno"].subjects == (("radio", "r1"), ("radio", "r2"))
    assert guarantees["small_gain"].subjects == (("r1", "gain"),)
    assert guarantees["told"].fields == {"below": 1.0, "above": -1.0}
    assert [guarantee.unit for guarantee in guarantees.values()] == ["s", "", "s", "", ""]


def test_what_is_stated_is_expected_to_hold_unless_said_otherwise(valid, write):
    expect = load(write(valid + STATED)).expect

    assert (expect["guarantee.fresh.violations"].min, expect["guarantee.fresh.violations"].max) == (None, 0.0)
    assert (expect["guarantee.losses.violations"].min, expect["guarantee.losses.violations"].max) == (1.0, None)


def test_an_expectation_of_ones_own_goes_before_the_implied_one(valid, write):
    own = STATED + '[expect]\n"guarantee.fresh.violations" = { max = 3 }\n"guarantee.fresh.worst_s" = { max = 0.07 }\n'

    expect = load(write(valid.partition("[expect]")[0] + own)).expect

    assert (expect["guarantee.fresh.violations"].min, expect["guarantee.fresh.violations"].max) == (None, 3.0)
    assert expect["guarantee.fresh.worst_s"].max == 0.07


def test_a_pattern_means_the_links_that_are_there_at_some_time(valid, write):
    switching = valid.replace('preset = "crazyflie_p2p"', """topology = { kind = "switching", schedule = [
        { at_s = 0, graph = "none" }, { at_s = 1, graph = "one" }], graphs = { none = [], one = ["r2 -> r1"] } }""")

    def links(length_s: float):
        scenario = load(write(switching + STATED.partition("[guarantees.no_zeno]")[0].replace(
            '"radio: r1 -> r2"', '"radio: r2 -> r1"')), duration_s=length_s)
        return scenario.guarantees["losses"].subjects
    assert links(1.5) == (("radio", "r2", "r1"),)
    with pytest.raises(ScenarioError) as error:         # over before the graph changes
        links(1.0)
    assert any("no such link at any time of the run" in line for line in error.value.problems)


def test_a_guarantee_may_be_about_a_derived_signal(valid, write):
    derived = """
[derived.error]
function = "operator:sub"
of = ["r1.x", "r2.x"]
signals = { x = "m" }
[guarantees.near]
kind = "signal"
on = "error.x"
below = 0.5
"""

    assert load(write(valid + derived)).guarantees["near"].subjects == (("error", "x"),)
    with pytest.raises(ScenarioError) as error:
        load(write(valid + derived.replace('"error.x"', '"error.y"')))
    assert error.value.problems == ['few.toml: guarantees.near.on="error.y": derived.error has no signal \'y\'; '
                                    "there is only x"]


EACH = [
    ('kind = "age_of_information"', 'kind = "age_of_informtion"',
     ['guarantees.fresh.kind="age_of_informtion": no such kind; did you mean "age_of_information"?']),
    ('kind = "age_of_information"\n', "", ["guarantees.fresh.kind: is missing; there are age_of_information, "
                                           "execution, formula, in_view, inter_transmission_time, reported, signal, "
                                           "successive_losses"]),
    ('on = "radio: r1 -> r2"\nbelow', "below", ["guarantees.fresh.on: is missing"]),
    ("below_ms = 50\n", "", ["guarantees.fresh.below_s: is missing; write it in one of below_s, below_ms, below_us, "
                             "below_ns"]),
    ("below_ms = 50", "below_ms = 0", ["guarantees.fresh.below_ms=0 (below_ns=0): expected more than 0"]),
    ("below_ms = 50", "belov_ms = 50", ['guarantees.fresh.belov_ms=50: unknown key; did you mean "below_ms"?']),
    ("at_most = 1", "at_most = -1", ["guarantees.losses.at_most=-1: expected 0 or more frames in a row"]),
    ("at_most = 1", "at_most = 1.5", ["guarantees.losses.at_most=1.5: expected a whole number"]),
    ('expected = "violated"', 'expected = "broken"',
     ["guarantees.losses.expected=\"broken\": expected 'holds' or 'violated'"]),
    ('on = "radio: r1 -> r2"\nbelow', 'on = "radio: r1 -> r3"\nbelow',
     ["guarantees.fresh.on=\"radio: r1 -> r3\": 'radio: r1 -> r3': 'r3' names no node on medium 'radio': "
      "nearest: 'r2'"]),
    ('"radio: r*"', '"raido: r*"', ["guarantees.no_zeno.on=\"raido: r*\": 'raido' names no medium; nearest: 'radio'"]),
    ('"r1.gain"', '"r11.gain"', ["guarantees.small_gain.on=\"r11.gain\": 'r11' names no node; nearest: 'r1'"]),
    ("below = 1.0\n", "", ["guarantees.small_gain: guarantees nothing; give below, above or both"]),
    ("above = -1", "above = 2", ["guarantees.told.below=1.0: nothing lies between it and above=2.0"]),
    ("at_least_us = 17", 'at_least_us = 17\ninstant = "sent"',
     ["guarantees.no_zeno.instant=\"sent\": expected 'handed_out' or 'on_air'"]),
    ("[guarantees.told]", '[guarantees."a.b"]',
     ['guarantees."a.b": a name has letters, digits, - and _, and starts with a letter']),
    ("length_s = 2.5", "length_s = 2.5\nsample_period_s = 0",
     ['guarantees.small_gain.on="r1.gain": no signal is sampled while sample_period_s is 0; give it a value']),
    ("frames_lost_on_link = { min = 1 }", '"guarantee.fresh.worst" = { max = 1 }',
     ["expect.guarantee.fresh.worst: guarantees.fresh has the figures violations, first_violation_s, violated_s, "
      "worst_s, margin_s; nearest: guarantee.fresh.worst_s"]),
    ("frames_lost_on_link = { min = 1 }", '"guarantee.flesh.violations" = { max = 1 }',
     ["expect.guarantee.flesh.violations: there is no guarantee 'flesh'; nearest: guarantee.fresh.violations"]),
    ("frames_lost_on_link = { min = 1 }", '"guarantee.fresh" = { max = 1 }',
     ["expect.guarantee.fresh: expected <metric>, <medium>.<metric>, <node>.<signal>.<statistic>, "
      "count.<node>.<counter>, guarantee.<name>.<figure> or real_time.<figure>; nearest: guarantee.fresh.worst_s"]),
    ("frames_lost_on_link = { min = 1 }", '"guarantee.fresh.violations" = { max = 1, during_s = [0, 1] }',
     ['expect."guarantee.fresh.violations"={ max = 1, during_s = [0, 1] }: during: only signals, numbers of frames and '
      "the delivery ratio can be judged over a part of the run"]),
]


@pytest.mark.parametrize(("right", "wrong", "lines"), EACH, ids=[wrong or f"no {right}" for right, wrong, _ in EACH])
def test_a_mistake_is_one_line_with_place_value_rule_and_remedy(right, wrong, lines, valid, write):
    text = valid + STATED
    assert text.count(right) >= 1

    with pytest.raises(ScenarioError) as error:
        load(write(text.replace(right, wrong, 1)))

    assert error.value.problems == [f"few.toml: {line}" for line in lines]


def test_all_mistakes_come_at_once_with_those_of_other_sections(valid, write):
    wrong = (valid + STATED).replace("seed = 7", "sead = 7").replace("at_most = 1", "at_mots = 1").replace(
        '"r1.gain"', '"r1"').replace("below_ms = 50", "below_ms = true")

    with pytest.raises(ScenarioError) as error:
        load(write(wrong))

    assert sorted(line.split(":")[1].split("=")[0].strip() for line in error.value.problems) == [
        "guarantees.fresh.below_ms", "guarantees.losses.at_mots", "guarantees.small_gain.on", "sead"]


@pytest.mark.parametrize("table", ["guarantees = 3", "guarantees = { fresh = 3 }", "guarantees = { fresh = [] }"])
def test_what_is_no_table_is_said_to_be_none(table, valid, write):
    with pytest.raises(ScenarioError) as error:
        load(write(table + "\n" + valid))

    line, = error.value.problems
    assert line.endswith("expected a table")


def test_a_guarantee_cannot_be_invented_on_the_command_line_but_changed(valid, write):
    changed = load(write(valid + STATED), overrides=["guarantees.fresh.below_s=0.25"])

    assert changed.guarantees["fresh"].fields == {"below_ns": 250_000_000}
    with pytest.raises(ScenarioError) as error:
        load(write(valid + STATED), overrides=["guarantees.flesh.below_s=0.25"])
    assert error.value.problems == ["few.toml: --set guarantees.flesh.below_s=0.25: guarantees has no 'flesh'; "
                                    'did you mean "fresh"?']
