"""Programs beside a scenario: each folder has its own, whatever was loaded before."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.own_modules import module_for


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
