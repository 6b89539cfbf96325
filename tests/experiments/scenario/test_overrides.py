"""`--set path.to.key=value`: what it changes and what it refuses."""

from __future__ import annotations

import pytest

from experiments.scenario import ScenarioError, load


def test_an_entry_of_a_list_can_be_changed(valid, write):
    scenario = load(write(valid), overrides=["impairments[0].loss_ratio=0.3"])

    assert scenario.impairments[0].fields["loss_ratio"] == 0.3


def test_a_key_left_at_its_default_can_be_set(valid, write):
    scenario = load(write(valid), overrides=["agents.r2.clock.drift_ppm=-5", "sample_period_s = 0.5",
                                             "agents.r2.plant.fmu='wheel_motor'"])

    assert scenario.agents["r2"].clock.drift_ppm == -5
    assert scenario.agents["r2"].plant.fmu == "wheel_motor"
    assert scenario.sample_period_ns == 500_000_000


def test_a_time_replaces_the_same_time_in_another_unit(valid, write):
    scenario = load(write(valid), overrides=["length_ms=40", "impairments[1].delay_s=0.001"])

    assert scenario.length_ns == 40_000_000
    assert scenario.impairments[1].fields == {"delay_ns": 1_000_000}


def test_a_quoted_key_and_a_table_as_value_can_be_given(valid, write):
    scenario = load(write(valid), overrides=['expect."*.y.last_abs"={ min = 1, max = 2 }',
                                             "team.models.r1.A[0][1]=8.0"])

    assert (scenario.expect["*.y.last_abs"].min, scenario.expect["*.y.last_abs"].max) == (1.0, 2.0)
    assert scenario.agents["r1"].plant.parameters["A"] == [[-1.0, 8.0], [0.0, -3.0]]


def test_the_team_may_be_told_what_the_file_does_not_say(valid, write):
    scenario = load(write(valid), overrides=["team.max_successive_losses=2", "team.models.r9.x0=[1.0]"])

    assert scenario.team["max_successive_losses"] == 2
    assert scenario.team["models"] == {"r1": {"A": [[-1.0, 2.0], [0.0, -3.0]], "K": [[4.0]]}, "r9": {"x0": [1.0]}}


def test_later_overrides_go_before_earlier_ones(valid, write):
    assert load(write(valid), overrides=["seed=1", "seed=2"]).seed == 2


@pytest.mark.parametrize(("override", "complaint"), [
    ("agents.r11.at_m=[0.0, 0.0]", "agents has no 'r11'; did you mean \"r1\"?"),
    ("agent.r1.at_m=[0.0, 0.0]", 'unknown key; did you mean "agents"?'),
    ("media.radoi.preset='ideal'", "media has no 'radoi'; did you mean \"radio\"?"),
    ("expect.frames_lots.min=3", "expect has no 'frames_lots'; did you mean \"frames_lost_on_link\"?"),
    ("impairments[2].loss_ratio=0.3", "impairments has 2 entries, the first is [0]"),
    ("impairments.loss_ratio=0.3", "impairments is no table; name the entry, as in impairments[0].loss_ratio"),
    ("impairments.0.loss_ratio=0.3", "impairments is no table; name the entry, as in impairments[0]"),
    ("seed.x=3", "seed is no table"),
    ("seed[0]=3", "seed is no list"),
    ("seed", "expected path.to.key=value, as in impairments[0].loss_ratio=0.3"),
    ("=3", "expected path.to.key=value, as in impairments[0].loss_ratio=0.3"),
    ("agents.r1.media=radio", "'radio' is not a TOML value; text needs quotes: 'agents.r1.media=\"...\"'"),
    ("seed=", "'' is not a TOML value; text needs quotes: 'seed=\"...\"'"),
    ("seed=" + "[" * 5000, "'" + "[" * 5000 + "' is not a TOML value; text needs quotes: 'seed=\"...\"'"),
])
def test_what_names_nothing_in_the_file_is_refused(override, complaint, valid, write):
    with pytest.raises(ScenarioError) as error:
        load(write(valid), overrides=[override])

    assert error.value.problems == [f"few.toml: --set {override}: {complaint}"]


def test_all_wrong_overrides_are_reported_at_once(valid, write):
    with pytest.raises(ScenarioError) as error:
        load(write(valid), overrides=["a=1", "seed=3", "b=2"])

    assert len(error.value.problems) == 2


def test_an_overriding_value_obeys_the_rules_of_its_key(valid, write):
    with pytest.raises(ScenarioError) as error:
        load(write(valid), overrides=["agents.r2.clock.drft_ppm=3", "impairments[0].loss_ratio=7"])

    assert error.value.problems == [
        'few.toml: agents.r2.clock.drft_ppm=3: unknown key; did you mean "drift_ppm"?',
        "few.toml: impairments[0].loss_ratio=7.0: expected 0 <= loss_ratio < 1"]
