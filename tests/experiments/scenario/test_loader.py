"""What a valid file becomes: names resolved, defaults filled in, every time an int of nanoseconds."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from random import Random

import msgspec
import pytest

from experiments.scenario import Bound, PlantSpec, Scenario, ScenarioError, catalog, load, network
from netem.impairments.gilbert_elliott import GilbertElliott
from netem.impairments.table import IMPAIRMENTS
from netem.media.broadcast_radio import BroadcastRadio
from netem.media.table import MEDIA


@pytest.fixture
def scenario(valid: str, write) -> Scenario:
    return load(write(valid))


def test_the_header_is_in_nanoseconds_with_its_defaults(scenario):
    assert (scenario.name, scenario.seed, scenario.length_ns) == ("few", 7, 2_500_000_000)
    assert (scenario.sample_period_ns, scenario.node_timeout_s) == (10_000_000, 30.0)


def test_the_question_is_read_from_the_opening_comment(scenario):
    assert scenario.question == "does the loader read this?"


def test_a_file_without_a_question_has_an_empty_one(valid, write):
    assert load(write(valid.replace("# Question: does", "# Does"))).question == ""


def test_agents_keep_their_order_and_have_the_defaults_under_their_own_keys(scenario):
    r1, r2 = scenario.agents.values()

    assert (r1.name, r2.name) == ("r1", "r2")
    assert r1.program == r2.program == "robots_of_the_tests:Talker"
    assert (r1.clock.offset_ns, r1.clock.drift_ppm) == (5_000, 20.0)
    assert (r2.clock.offset_ns, r2.clock.drift_ppm) == (0, 20.0)
    assert (r1.at_m, r2.at_m) == ((0.0, 1.0), None)


def test_an_agents_time_replaces_a_default_in_another_unit(valid, write):
    text = valid.replace("clock = { drift_ppm = 20.0 }", "clock = { offset_s = 1.0 }")

    agents = load(write(text)).agents

    assert (agents["r1"].clock.offset_ns, agents["r2"].clock.offset_ns) == (5_000, 1_000_000_000)


def test_parameters_of_a_program_may_be_times(scenario):
    assert scenario.agents["r1"].parameters == {"slot_ns": 1_100_000}
    assert scenario.agents["r2"].parameters == {}


def test_paths_start_at_the_scenarios_folder(valid, write):
    path = write(valid.replace("{ slot_ms = 1.1 }", '{ log = "logs/r1.txt" }'))

    assert load(path).agents["r1"].parameters == {"log": str(path.parent / "logs/r1.txt")}


def test_a_trace_is_found_beside_the_scenario(valid, write):
    path = write(valid.replace('kind = "delay"\ndelay_us = 20', 'kind = "trace"\nfile = "lost.csv"'))
    (path.parent / "lost.csv").write_text("lost\n0\n1\n")

    assert load(path).impairments[1].fields == {"file": str(path.parent / "lost.csv")}


def test_a_plant_takes_the_parameters_it_has_from_the_teams_knowledge(scenario):
    assert scenario.agents["r1"].plant == PlantSpec("linear_system", {"A": [[-1.0, 2.0], [0.0, -3.0]]})


def test_a_plants_own_parameters_go_before_the_teams(valid, write):
    text = valid.replace('"team.models.r1" }', '"team.models.r1", parameters = { A = [[-9.0]], "B[1,2]" = 4 } }')

    assert load(write(text)).agents["r1"].plant.parameters == {"A": [[-9.0]], "B[1,2]": 4}


def test_agents_are_on_every_medium_unless_they_name_some(scenario):
    assert scenario.agents["r1"].media == ("radio", "quiet")
    assert [medium.nodes for medium in scenario.media.values()] == [("r1", "r2"), ("r1",)]


def test_settings_of_a_medium_are_its_own_class(scenario):
    radio = scenario.media["radio"]

    assert isinstance(radio.settings, MEDIA[radio.kind].Settings)
    assert radio.settings.preset == "crazyflie_p2p"


def test_impairments_are_resolved_to_links_and_windows(scenario):
    burst, delay = scenario.impairments

    assert (burst.place, burst.links) == ("impairments[0]", (("radio", "r1", "r2"),))
    assert burst.windows_ns == ((500_000_000, 1_000_000_000),)
    assert (delay.links, delay.windows_ns) == ((("radio", "r1", "r2"), ("radio", "r2", "r1")), ())
    assert delay.fields == {"delay_ns": 20_000}


def test_several_windows_may_be_listed(valid, write):
    text = valid.replace("during_s = [0.5, 1.0]", "during_ms = [[500, 1000], [1200, 1300.5]]")

    assert load(write(text)).impairments[0].windows_ns == ((500_000_000, 1_000_000_000), (1_200_000_000, 1_300_500_000))


def test_fields_of_an_impairment_construct_it(scenario):
    for spec in scenario.impairments:
        assert IMPAIRMENTS[spec.kind](**spec.fields, rng=Random(0)) is not None


def test_expectations_are_bounds(scenario):
    assert scenario.expect == {"frames_lost_on_link": Bound(min=1), "*.y.last_abs": Bound(max=1e-3)}


def test_seed_and_duration_of_the_command_replace_those_of_the_file(valid, write):
    path = write(valid.replace("length_s = 2.5", "length_ms = 2500"))

    scenario = load(path, seed=8, duration_s=0.1)

    assert (scenario.seed, scenario.length_ns) == (8, 100_000_000)


def test_a_scenario_cannot_be_changed(scenario):
    with pytest.raises(AttributeError):
        scenario.seed = 3


def test_a_resolved_scenario_is_plain_json_that_says_everything(scenario):
    plain = scenario.resolved()

    assert json.loads(json.dumps(plain)) == plain == json.loads(msgspec.json.encode(plain))
    assert list(plain) == list(Scenario.__struct_fields__)
    assert plain["media"]["radio"]["settings"]["preset"] == "crazyflie_p2p"
    assert plain["agents"]["r2"]["clock"] == {"offset_ns": 0, "drift_ppm": 20.0, "tick_ns": 1}


def test_loading_twice_gives_the_same(valid, write):
    assert load(write(valid)) == load(write(valid))


@pytest.mark.parametrize("entry", catalog(), ids=lambda entry: entry.name)
def test_every_shipped_scenario_loads_and_asks_a_question(entry):
    try:
        scenario = load(entry.path)
    except ScenarioError as error:
        pytest.fail(str(error))

    assert scenario.question
    assert Path(scenario.path) == entry.path


def test_each_medium_and_impairment_is_built_once(valid, write, monkeypatch):
    built: list[str] = []

    class Radio(BroadcastRadio):
        def __init__(self, name, *rest):
            built.append(name)
            super().__init__(name, *rest)

    @dataclass
    class Burst(GilbertElliott):
        def __post_init__(self):
            built.append("burst")
            super().__post_init__()

    monkeypatch.setattr(network, "MEDIA", {"broadcast_radio": Radio})
    monkeypatch.setattr(network, "IMPAIRMENTS", {**IMPAIRMENTS, "gilbert_elliott": Burst})
    fresh = '[guarantees.fresh]\nkind = "age_of_information"\non = "radio: * -> *"\nbelow_ms = 50\n[expect]'

    load(write(valid.replace("[expect]", fresh)))

    assert sorted(built) == ["burst", "quiet", "radio"]
