"""Makes the `Settings` that a program declares from its agent's table `parameters`.

    class Beacon:
        @dataclass(frozen=True)
        class Settings:
            period_ns: int

        def __init__(self, board, settings): ...

The loader has checked the values; the robot's process gets them as plain JSON types.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import msgspec


def settings_class(program: Callable[..., Any]) -> type | None:
    """Return the dataclass that the program declares; None if it takes no parameters."""
    found = getattr(program, "Settings", None)
    return found if isinstance(found, type) else None


def build_settings(program: Callable[..., Any], parameters: Mapping[str, Any]) -> Any:
    """Return an instance of the program's `Settings`, None if it declares none; raises what their own checks raise."""
    cls = settings_class(program)
    return None if cls is None else msgspec.convert(parameters, cls, dec_hook=_other)


def construct_program(program: Callable[..., Any], board: Any, parameters: Mapping[str, Any]) -> Any:
    """Return `program(board, settings)`, or `program(board)` if it declares no settings."""
    settings = build_settings(program, parameters)
    return program(board) if settings is None else program(board, settings)


def _other(hint: type, value: Any) -> Any:
    """Return a value of a type that msgspec does not know, as Path, constructed from `value`."""
    return hint(value)
