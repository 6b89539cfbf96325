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


def test_a_function_that_takes_any_keyword_gets_what_is_written(valid, write):
    path = write(valid.replace("robots_of_the_tests:Talker", "keen_robot_of_the_tests:robot"))
    (path.parent / "keen_robot_of_the_tests.py").write_text("def robot(**rest): pass\n")

    assert load(path).agents["r1"].parameters == {"slot_ms": 1.1}


# --- the face of a program

HEAD = "from dataclasses import dataclass\n\n\nclass Robot:\n"
WITH_SETTINGS = HEAD + '''    @dataclass
    class Settings:
        slot_ns: int = 1_000_000

    def __init__(self, board, settings): pass
'''


@pytest.mark.parametrize(("module", "reason"), [
    (HEAD + "    def __init__(self, board, *, slot_ns: int = 5, gain: float): pass\n",
     "Robot takes slot_ns, gain besides the board: declare them as fields of a dataclass `Settings` of the class, "
     "and write __init__(self, board, settings)"),
    (HEAD + "    def __init__(self, board, slot_ns=5): pass\n",
     "Robot takes slot_ns besides the board: declare them as fields of a dataclass `Settings` of the class, and write "
     "__init__(self, board, settings)"),
    (WITH_SETTINGS.replace("(self, board, settings)", "(self, board)"),
     "Robot(board): expected Robot(board, settings)"),
    (WITH_SETTINGS.replace("(self, board, settings)", "(self)"), "takes no board: Robot() has no positional argument"),
    (WITH_SETTINGS.replace("    @dataclass\n", ""), "Robot.Settings is no dataclass"),
    (WITH_SETTINGS + "    @staticmethod\n    def check(scenario): pass\n",
     "Robot.check(scenario): expected check(scenario, own), where `own` holds the agents that run this program, with "
     "their settings"),
    (WITH_SETTINGS + "    @staticmethod\n    def prepare(scenario): pass\n",
     "Robot.prepare(scenario): expected prepare(scenario, own), where `own` holds the agents that run this program, "
     "with their settings"),
])
def test_a_program_with_another_face_is_told_the_one_of_today(module, reason, valid, write):
    assert refusal("broken_robot_of_the_tests:Robot", valid, write, module) == reason


def test_check_and_prepare_see_the_agents_that_run_their_program_with_their_settings(valid, write):
    path = write(valid.replace("robots_of_the_tests:Talker", "asked_robot_of_the_tests:Robot").replace(
        "[agents.r2]", '[agents.other]\nprogram = "robots_of_the_tests:Talker"\n[agents.r2]'))
    (path.parent / "asked_robot_of_the_tests.py").write_text(WITH_SETTINGS + '''
    @staticmethod
    def check(scenario, own):
        for name, agent in own.items():
            yield f"{name}: {agent.settings.slot_ns} {agent.has_plant} {list(agent.media)} {len(scenario.agents)}"
''')

    with pytest.raises(ScenarioError) as error:
        load(path)

    assert error.value.problems == ["few.toml: r1: 1100000 True ['radio', 'quiet'] 3",
                                    "few.toml: r2: 1000000 False ['radio'] 3"]
