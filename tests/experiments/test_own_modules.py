"""Programs beside a scenario: each folder has its own, whatever was loaded before."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.own_modules import module_for
from experiments.run_data import load_run
from experiments.runner import run
from experiments.scenario import load


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


def test_what_is_installed_comes_first(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "d", json="WHO = 'd'")

    assert not hasattr(module_for("json", folder), "WHO")


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
               "        board.node.count('{who}')\n")
    here = folder_with(tmp_path / "here", robot_of_two=program.format(who="here"))
    there = folder_with(tmp_path / "there", robot_of_two=program.format(who="there"))
    (there / "s.toml").write_text('# Question: whose robot runs?\nseed = 1\nlength_s = 0.01\n'
                                  '[agents.a]\nprogram = "robot_of_two:Counter"\n'
                                  '[media.radio]\nkind = "broadcast_radio"\n')
    monkeypatch.chdir(here)

    counted = [load_run(run(load(there / "s.toml"), host=host, out=tmp_path / host).folder).counters["a"]
               for host in ("inline", "process")]

    assert counted == [{"there": 1}, {"there": 1}]
