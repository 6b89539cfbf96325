"""Programs by import path: found beside the scenario, refused with a reason."""

from __future__ import annotations

import pytest

from experiments.scenario import ScenarioError, load
from experiments.scenario.program import import_program


def refusal(program, valid, write, module=None):
    path = write(valid.replace("robots_of_the_tests:Talker", program))
    if module is not None:
        (path.parent / "broken_robot_of_the_tests.py").write_text(module)
    with pytest.raises(ScenarioError) as error:
        load(path)
    (line,) = [line for line in error.value.problems if "defaults.program" in line]
    return line.removeprefix(f'few.toml: agents_defaults.program="{program}": ')


def test_a_program_beside_the_scenario_is_found(valid, write):
    folder = write(valid).parent

    assert import_program("robots_of_the_tests:Talker", folder).__name__ == "Talker"


@pytest.mark.parametrize(("program", "reason"), [
    ("agents.synchronisation.robot:SyncRobot",
     "there is no module 'agents.synchronisation'; did you mean \"agents.synchronization\"?"),
    ("robots_of_the_tests:not_a_class", 'not_a_class is no class; did you mean "Talker"?'),
    ("robots_of_the_tests", "expected 'package.module:Class'"),
    ("robots of the tests:Talker", "expected 'package.module:Class'"),
    ("..:Talker", "expected 'package.module:Class'"),
])
def test_a_program_that_is_not_there_is_refused(program, reason, valid, write):
    assert refusal(program, valid, write).startswith(reason.split(";")[0])


@pytest.mark.parametrize(("module", "reason"), [
    ("import nothing_of_that_name", "broken_robot_of_the_tests needs the module 'nothing_of_that_name', which is not "
                                    "installed"),
    ("1 / 0", "importing it failed: ZeroDivisionError: division by zero"),
    ("def", "importing it failed: SyntaxError: invalid syntax (broken_robot_of_the_tests.py, line 1)"),
])
def test_a_module_that_fails_is_refused_with_its_error(module, reason, valid, write):
    assert refusal("broken_robot_of_the_tests:Robot", valid, write, module) == reason


def test_a_program_that_takes_any_keyword_gets_what_is_written(valid, write):
    path = write(valid.replace("robots_of_the_tests:Talker", "keen_robot_of_the_tests:Robot"))
    (path.parent / "keen_robot_of_the_tests.py").write_text(
        "class Robot:\n    def __init__(self, board, **rest): pass\n")

    assert load(path).agents["r1"].parameters == {"slot_ms": 1.1}
