"""The way of a value through the loader: which functions of ours have it, or a table that holds it, in their hands."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

OURS = Path(__file__).parents[3]


def hops(call: Callable[[], Any], value: float, last: str) -> list[str]:
    """In the order in which they got it, up to the one named `last`. A function has it if an argument, a local
    variable or its result is `value` or a table or list with it somewhere inside. A function within a function is a
    part of it.

    `value` has to be a number that nothing else in the scenario is equal to.
    """
    found: dict[CodeType, str] = {}
    inner: set[CodeType] = set()

    def look(frame: FrameType, event: str, result: Any) -> None:
        code = frame.f_code
        inner.update(part for part in code.co_consts if isinstance(part, CodeType))
        if event not in ("call", "return") or code in found or code in inner or not _is_ours(code):
            return
        if any(_holds(one, value) for one in (*frame.f_locals.values(), *([result] if event == "return" else []))):
            found[code] = _name(frame)

    sys.setprofile(look)
    try:
        call()
    finally:
        sys.setprofile(None)
    names = list(found.values())
    return names[:names.index(last) + 1]


def _name(frame: FrameType) -> str:
    """With its class where `dataclass` made it."""
    code = frame.f_code
    return f"{type(frame.f_locals['self']).__name__}.__init__" if code.co_filename == "<string>" else code.co_qualname


def _is_ours(code: CodeType) -> bool:
    """Code of this project, without the tests; or made by `dataclass`, which has no file."""
    if code.co_filename == "<string>":
        return code.co_name == "__init__"
    path = Path(code.co_filename)
    return OURS in path.parents and "tests" not in path.parts and ".venv" not in path.parts


def _holds(where: Any, value: float) -> bool:
    if isinstance(where, dict):
        return any(_holds(part, value) for part in where.values())
    if isinstance(where, list | tuple):
        return any(_holds(part, value) for part in where)
    return type(where) in (int, float) and where == value
