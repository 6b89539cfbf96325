"""The JSON Schema accepts what `check` accepts, and refuses wrong keys, types and kinds as `check` does."""

from __future__ import annotations

import tomllib
from pathlib import Path

import jsonschema
import pytest

from experiments.scenario import ScenarioError, load
from experiments.scenario.json_schema import scenario_schema
from experiments.scenario.library import catalog

BROKEN = [("seed = 7", "sead = 7"), ("seed = 7", "seed = -1"), ("seed = 7", 'seed = "7"'), ("length_s = 2.5\n", ""),
          ("length_s = 2.5", "length_s = 0"), ('kind = "delay"', 'kind = "dely"'),
          ('kind = "broadcast_radio"', 'kind = "broadcast"'), ("delay_us = 20", 'delay_us = "20"'),
          ("[agents.r1]", '[agents.r1]\nplnat = { fmu = "x" }'), ("[expect]", "[expects]"), ("min = 1", "minimum = 1")]


@pytest.fixture(scope="module")
def validator():
    schema = scenario_schema()
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema)


@pytest.mark.parametrize("entry", catalog(), ids=lambda entry: entry.name)
def test_every_scenario_of_ours_fits(entry, validator):
    document = tomllib.loads(entry.path.read_text(encoding="utf-8"))

    assert [error.message for error in validator.iter_errors(document)] == []


def test_a_case_that_does_not_fit_is_refused_by_check(validator):
    for path in sorted((Path(__file__).parents[2] / "cases").rglob("*.toml")):
        document = tomllib.loads(path.read_text(encoding="utf-8"))
        if "length_s" in document and not validator.is_valid(document):
            with pytest.raises(ScenarioError):
                load(path)


@pytest.mark.parametrize(("right", "wrong"), BROKEN)
def test_a_broken_scenario_does_not_fit_and_is_refused_by_check(right, wrong, valid, write, validator):
    assert right in valid
    broken = valid.replace(right, wrong, 1)

    assert not validator.is_valid(tomllib.loads(broken))
    with pytest.raises(ScenarioError):
        load(write(broken))
