"""From an agent's parameters, in plain JSON types, to the `Settings` of its program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from firmware_sim.program_settings import build_settings, construct_program, settings_class


@dataclass(frozen=True)
class Loop:
    gain: float
    period_ns: int = 5


@dataclass(frozen=True)
class RobotSettings:
    loop: Loop
    log: Path | None = None
    start: tuple[float, float] = (0.0, 0.0)
    table: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.loop.gain < 0:
            raise ValueError(f"gain={self.loop.gain}: expected 0 or more")


class Robot:
    Settings = RobotSettings

    def __init__(self, board: object, settings: RobotSettings) -> None:
        self.board, self.settings = board, settings


class Plain:
    def __init__(self, board: object) -> None:
        self.board = board


def test_tables_lists_and_paths_become_what_the_settings_declare() -> None:
    given = {"loop": {"gain": 2.0}, "log": "a/b.csv", "start": [1.0, 2.0], "table": {"a": 1.0}}

    assert build_settings(Robot, given) == RobotSettings(Loop(2.0), Path("a/b.csv"), (1.0, 2.0), {"a": 1.0})
    assert build_settings(Robot, {"loop": {"gain": 2.0}}) == RobotSettings(Loop(2.0))


def test_the_rules_of_the_settings_are_kept() -> None:
    with pytest.raises(ValueError, match=r"gain=-1\.0: expected 0 or more"):
        build_settings(Robot, {"loop": {"gain": -1.0}})


def test_a_program_is_constructed_with_its_settings_or_without_if_it_declares_none() -> None:
    robot, plain = (construct_program(program, "board", {"loop": {"gain": 2.0}}) for program in (Robot, Plain))

    assert (robot.board, robot.settings) == ("board", RobotSettings(Loop(2.0)))
    assert plain.board == "board"
    assert (settings_class(Robot), settings_class(Plain)) == (RobotSettings, None)
