"""Whatever becomes of a valid file, loading it gives a scenario or a ScenarioError with lines, nothing else."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from experiments.scenario import Scenario, ScenarioError, load
from tests.examples import examples

SPARE_TIME = settings(max_examples=examples(60), suppress_health_check=[HealthCheck.function_scoped_fixture])
JUNK = st.one_of(
    st.sampled_from(["nan", "-inf", "true", "[]", "{}", '""', "-1", "0", "1e400", "2020-01-01", "[[1], [2, 3]]", "'*'",
                     "{ a = { b = 1 } }", "[true, 'x']", "99999999999999999999", "[[[]]]", "'../..'", "12:00:00"]),
    st.integers().map(str), st.floats().map(repr),
    st.text(st.characters(codec="utf-8", categories=["L", "N", "P"]), max_size=8).map(lambda text: f"'{text}'"))


def is_one_line(problem):
    """With a mistake in a formula the line of the formula and a caret below it follow."""
    line, _, pointer = problem.partition("\n")
    return bool(line) and (not pointer or (pointer.count("\n") == 1 and pointer.endswith("^")))


def survives(path, **options):
    try:
        outcome = load(path, **options)
    except ScenarioError as error:
        outcome = error
    assert isinstance(outcome, Scenario) or all(map(is_one_line, outcome.problems))
    assert isinstance(outcome, Scenario) or outcome.problems


@SPARE_TIME
@given(data=st.data())
def test_a_value_replaced_by_junk(data, valid, write):
    lines = valid.splitlines()
    place = data.draw(st.sampled_from([index for index, line in enumerate(lines) if " = " in line]))
    key = lines[place].split(" = ")[0]
    lines[place] = f"{key} = {data.draw(JUNK)}"

    survives(write("\n".join(lines)))


@SPARE_TIME
@given(data=st.data())
def test_lines_removed_repeated_and_moved(data, valid, write):
    lines = valid.splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        index = data.draw(st.integers(0, len(lines) - 1))
        line = lines.pop(index)
        for _ in range(data.draw(st.integers(0, 2))):
            lines.insert(data.draw(st.integers(0, len(lines))), line)

    survives(write("\n".join(lines)))


@SPARE_TIME
@given(data=st.data())
def test_characters_changed(data, valid, write):
    text = list(valid)
    for _ in range(data.draw(st.integers(1, 5))):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(
            st.one_of(st.sampled_from(" \n.[]{}=\"'#,-_019aez"), st.characters(codec="utf-8")))

    survives(write("".join(text)))


@SPARE_TIME
@given(path=st.sampled_from(["seed", "length_s", "agents.r1", "agents.r1.clock", "agents.r1.parameters.slot_ms", "team",
                        "agents.r1.plant.parameters_from", "agents", "media", "media.radio", "media.radio.topology",
                        "impairments", "impairments[0]", "impairments[0].during_s", "impairments[1].kind", "expect",
                        "expect.frames_lost_on_link", "agents_defaults", "agents_defaults.clock", "team.models.r1.A[0]",
                        "agents.r1.plant.fmu", "media.radio.kind", "agents.r1.media", "impairments[0].on"]), junk=JUNK)
def test_junk_set_from_the_command_line(path, junk, valid, write):
    survives(write(valid), overrides=[f"{path}={junk}"])


def test_the_valid_file_is_valid(valid, write):
    assert tomllib.loads(valid)["seed"] == 7
    assert load(write(valid)).seed == 7


@pytest.mark.parametrize("duration_s", [float("nan"), float("inf"), -1.0, 0.0, 1e300, 1e-300])
def test_a_duration_that_is_none_is_refused(duration_s, valid, write):
    with pytest.raises(ScenarioError):
        load(write(valid), duration_s=duration_s)
