"""Functions that read and set the plant's variables that a firmware names, one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from firmware_sim.board import Board
from firmware_sim.firmware.description import Variable
from fmus.errors import PlantError


def readers(board: Board, row: Variable) -> list[Callable[[], float | None]]:
    """Return functions that read the entries of a sensor; those that the plant lacks give None."""
    def reader(variable: str) -> Callable[[], float | None]:
        read = board.sensors([variable], [row.unit or None]).read
        return lambda: read()[0]

    return [_no_value if made is None else made for made in _made(row, reader)]


def writers(board: Board, row: Variable) -> list[Callable[[tuple[float]], object]]:
    """Return functions that set the entries of an actuator; those that the plant lacks have no effect."""
    def writer(variable: str) -> Callable[[tuple[float]], object]:
        return board.actuators([variable], [row.unit or None]).write

    return [_no_effect if made is None else made for made in _made(row, writer)]


def _made(row: Variable, make: Callable[[str], Any]) -> Iterator[Any]:
    for number, variable in enumerate(row.variables):
        try:
            yield make(variable)
        except PlantError:
            if number == 0:
                raise
            yield None


def _no_value() -> None:
    return None


def _no_effect(values: tuple[float]) -> None:
    return None
