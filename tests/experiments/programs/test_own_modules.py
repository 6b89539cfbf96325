"""Programs beside a scenario: each folder has its own, whatever was loaded before."""

from __future__ import annotations

import inspect
import pickle
import sys
from importlib import import_module
from pathlib import Path
from typing import get_type_hints

import numpy
import pytest

from agents.pursuit import evaders
from experiments.judge.run_data import load_run
from experiments.programs.own_modules import ROOT, NameTaken, module_for
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load


def folder_with(path: Path, **files: str) -> Path:
    path.mkdir()
    for name, text in files.items():
        (path / f"{name}.py").write_text(text)
    return path


def test_two_folders_may_use_one_name(tmp_path: Path) -> None:
    a = folder_with(tmp_path / "a", my_robot="WHO = 'a'")
    b = folder_with(tmp_path / "b", my_robot="WHO = 'b'")

    assert [module_for("my_robot", folder).WHO for folder in (a, b, a)] == ["a", "b", "a"]
    assert module_for("my_robot", a) is module_for("my_robot", a)


def test_a_module_finds_its_neighbour(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "c", robot_of_c="from helper_of_c import WHO", helper_of_c="WHO = 'helped'")

    assert module_for("robot_of_c", folder).WHO == "helped"


def test_neighbours_of_one_name_in_two_folders_do_not_meet(tmp_path: Path) -> None:
    folders = [folder_with(tmp_path / who, robot="import helper\nWHO = helper.WHO", helper=f"WHO = '{who}'")
               for who in ("x", "y")]

    assert [module_for("robot", folder).WHO for folder in folders] == ["x", "y"]
    assert "helper" not in sys.modules


def test_a_neighbour_is_found_when_the_program_runs_too(tmp_path: Path) -> None:
    folders = [folder_with(tmp_path / who, robot="def who():\n    from helper import WHO\n    return WHO",
                           helper=f"WHO = '{who}'") for who in ("x", "y")]

    assert [module_for("robot", folder).who() for folder in folders] == ["x", "y"]


@pytest.mark.parametrize("name", ["signal", "json", "agents", "netem", "can", "types"])
def test_a_file_may_have_the_name_of_an_installed_module_and_neither_sees_the_other(tmp_path: Path, name: str) -> None:
    installed = import_module(name)
    folder = folder_with(tmp_path / "own", **{name: f"import {name} as installed\nWHO = 'own'",
                                              "robot": f"from {name} import WHO"})

    own = module_for(name, folder)

    assert own.WHO == "own"
    assert own.installed is installed               # a module that imports its own name gets the installed one
    assert module_for("robot", folder).WHO == "own"
    assert import_module(name) is sys.modules[name] is installed


def test_a_file_named_as_a_package_of_marconets_may_use_that_package(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "own", agents="from agents.pursuit.evaders import __doc__ as said",
                         robot="import agents.pursuit.evaders as e\nsaid = e.__doc__")

    assert module_for("agents", folder).said == module_for("robot", folder).said == evaders.__doc__


@pytest.mark.parametrize("package", ["agents", "experiments", "firmware_sim", "fmus", "marconet", "netem", "scenarios"])
@pytest.mark.parametrize("inside", ["__init__.py", "robot.py"])
def test_a_folder_named_as_a_package_of_marconets_is_refused_with_both_paths(tmp_path: Path, package: str,
                                                                              inside: str) -> None:
    (tmp_path / package).mkdir()
    (tmp_path / package / inside).touch()
    (tmp_path / "beacon.py").write_text(f"from {package}.robot import Robot")

    for name in (f"{package}.robot", "beacon"):
        with pytest.raises(NameTaken) as caught:
            module_for(name, tmp_path)

        assert str(caught.value) == (f"the folder {tmp_path / package} has the name of marconet's own package "
                                     f"{ROOT / package}: rename the folder, and the imports of it")


def test_such_a_folder_is_a_mistake_in_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "robot.py").write_text("class Robot:\n    def __init__(self, board): ...")
    (tmp_path / "s.toml").write_text('# Question: ours?\nseed = 1\nlength_s = 0.01\n[agents.a]\n'
                                     'program = "agents.robot:Robot"\n[media.radio]\nkind = "broadcast_radio"\n')

    with pytest.raises(ScenarioError, match=r"agents\.a\.program.*: the folder \S+/agents has the name of marconet's"):
        load(tmp_path / "s.toml")


def test_a_folder_of_such_a_name_without_modules_is_no_hindrance(tmp_path: Path) -> None:
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "agents").mkdir()
    folder_with(tmp_path / "robots", robot="from agents.pursuit.evaders import __doc__ as said")

    assert module_for("agents.pursuit.evaders", tmp_path) is evaders
    assert module_for("robots.robot", tmp_path).said == evaders.__doc__


def test_marconets_own_folder_is_no_hindrance() -> None:
    assert module_for("agents.pursuit.evaders", ROOT) is evaders


@pytest.mark.parametrize("marker", [True, False])
def test_packages_of_one_name_in_two_folders_do_not_meet(tmp_path: Path, marker: bool) -> None:
    for who in ("x", "y"):
        package = tmp_path / who / "crew"
        package.mkdir(parents=True)
        if marker:
            (package / "__init__.py").write_text(f"WHO = '{who}'")
        (package / "arm.py").write_text("from crew.hand import WHO\nfrom .hand import WHO as again\nimport crew.hand\n"
                                        "assert crew.hand.WHO == WHO == again")
        (package / "hand.py").write_text(f"WHO = '{who}'")

    assert [module_for("crew.arm", tmp_path / who).WHO for who in ("x", "y")] == ["x", "y"]
    assert not [name for name in sys.modules if name == "crew" or name.startswith("crew.")]


def test_a_folder_of_data_is_no_package(tmp_path: Path) -> None:
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy" / "make.py").touch()
    (tmp_path / "robot.py").write_text("import numpy")

    assert module_for("robot", tmp_path).numpy is numpy


@pytest.mark.parametrize("program", ["crew.nobody", "nobody", "crew.arm"])
def test_a_module_that_is_not_there_is_named_as_the_user_wrote_it(tmp_path: Path, program: str) -> None:
    (tmp_path / "crew").mkdir()
    (tmp_path / "crew" / "arm.py").write_text("import crew.nobody")

    with pytest.raises(ModuleNotFoundError, match=r"^No module named '(crew\.)?nobody'$") as caught:
        module_for(program, tmp_path)

    assert caught.value.name == ("nobody" if program == "nobody" else "crew.nobody")


def test_classes_of_such_a_module_can_be_pickled_inspected_and_are_dataclasses(tmp_path: Path) -> None:
    text = ("from __future__ import annotations\nfrom dataclasses import dataclass\n\n\n"
            "@dataclass\nclass Pose:\n    x: float\n    y: Other\n\n\nclass Other:\n    pass\n")
    for module in (module_for("robot", folder_with(tmp_path / "own", robot=text)),
                   module_for("robot", folder_with(tmp_path / "too", robot=text.replace("float", "int")))):
        pose = module.Pose(1.0, None)

        assert pickle.loads(pickle.dumps(pose)) == pose
        assert pickle._loads(pickle._dumps(pose)) == pose               # the one written in Python
        assert inspect.getsource(module.Other) == "class Other:\n    pass\n"
        assert inspect.getmodule(module.Pose) is module
        assert get_type_hints(module.Pose)["y"] is module.Other


def test_a_module_that_fails_is_tried_again(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "e", broken_robot="1 / 0")

    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            module_for("broken_robot", folder)


def test_a_robots_process_takes_its_program_from_the_scenarios_folder(tmp_path: Path,
                                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder in which the command was given may hold another file of that name."""
    program = ("class Counter:\n"
               "    def __init__(self, board):\n"
               "        board.count('{who}')\n")
    here = folder_with(tmp_path / "here", robot_of_two=program.format(who="here"))
    there = folder_with(tmp_path / "there", robot_of_two=program.format(who="there"))
    (there / "s.toml").write_text('# Question: whose robot runs?\nseed = 1\nlength_s = 0.01\n'
                                  '[agents.a]\nprogram = "robot_of_two:Counter"\n'
                                  '[media.radio]\nkind = "broadcast_radio"\n')
    monkeypatch.chdir(here)

    counted = [load_run(run(load(there / "s.toml"), host=host, out=tmp_path / host).folder).counters["a"]
               for host in ("inline", "process")]

    assert counted == [{"there": 1}, {"there": 1}]
