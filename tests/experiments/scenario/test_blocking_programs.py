"""A function as a program: its parameters are checked like a class's, and it may be a coroutine."""

from __future__ import annotations

import pytest

from experiments.run.node_specifications import node_specifications
from experiments.scenario import ScenarioError, load

PROGRAMS = '''
from pathlib import Path


def talk(channel: str, *, period_ns: int = 1_000_000, gain_db: float = 0.0, log: Path | None = None):
    pass


def anything(**parameters):
    pass


async def nap():
    yield


def steps():
    yield
'''


@pytest.fixture
def scenario(valid, write):
    def source(program, parameters="{}"):
        text = valid.replace("robots_of_the_tests:Talker", f"blocking_of_the_tests:{program}")
        path = write(text.replace("parameters = { slot_ms = 1.1 }\n", "")
                     .replace("[agents.r1]\n", f"parameters = {parameters}\n[agents.r1]\n"))
        (path.parent / "blocking_of_the_tests.py").write_text(PROGRAMS)
        return path

    return source


def test_a_function_takes_its_parameters_and_no_board(scenario):
    loaded = load(scenario("talk", '{ channel = "can0", period_ms = 2.5, log = "talk.log" }'))

    assert loaded.agents["r1"].parameters == {"channel": "can0", "period_ns": 2_500_000,
                                              "log": str(loaded.folder / "talk.log")}
    assert all(specification.blocking for specification in node_specifications(loaded).values())


def test_a_function_may_take_anything(scenario):
    assert load(scenario("anything", "{ whatever = [1, 2] }")).agents["r2"].parameters == {"whatever": [1, 2]}


@pytest.mark.parametrize(("program", "parameters", "complaint"), [
    ("talk", "{}", "channel"),
    ("talk", '{ channel = "can0", periods_ms = 2 }', "period_ms"),
    ("talk", "{ channel = 3 }", "channel=3"),
    ("nap", "{}", "nap is an asynchronous generator, which nobody would iterate; write a coroutine"),
    ("steps", "{}", "steps is a generator, which nobody would iterate; write blocking code, or a class"),
])
def test_what_does_not_fit_is_refused(scenario, program, parameters, complaint):
    with pytest.raises(ScenarioError) as error:
        load(scenario(program, parameters))

    assert any(complaint in line for line in error.value.problems)
