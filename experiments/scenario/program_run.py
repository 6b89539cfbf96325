"""Checks, without running it, that the method `run` of a class can be a robot's program.

    class Beacon:
        def run(self):                                      # a generator: it has a `yield`
            while True:
                yield from self.board.sleep_until(...)

A class without `run` is a program if it only reacts to frames and timers, or starts its processes itself.
"""

from __future__ import annotations

import dis
import inspect
from types import CodeType, FunctionType
from typing import Any

from netem.core.nearest import nearest

REMEDY = "wait in it with `yield from self.board.sleep_until(local_ns)`"


def complaint_about_run(cls: type) -> str:
    """Return the problem of `run` or of its absence; "" if none can be found before the run."""
    run = inspect.getattr_static(cls, "run", None)
    if run is None:
        return _never_started(cls)
    run = run.__func__ if isinstance(run, staticmethod | classmethod) else run
    if inspect.iscoroutinefunction(run) or inspect.isasyncgenfunction(run):
        return (f"{cls.__name__}.run is async, and asyncio does not run in virtual time; write `def run(self):` and "
                f"{REMEDY}")
    if isinstance(run, FunctionType) and not inspect.isgeneratorfunction(run) and not _returns_something(run.__code__):
        return (f"{cls.__name__}.run is no generator, as it has no `yield`: it would run through before time starts; "
                f"{REMEDY}")
    return ""


def _never_started(cls: type) -> str:
    methods = {name: value for name, value in vars(cls).items() if isinstance(value, FunctionType)}
    mentioned = {name for other, method in methods.items() for name in _names(method.__code__) if name != other}
    idle = [name for name, method in methods.items() if inspect.isgeneratorfunction(method) and name not in mentioned
            and not name.startswith("__")]
    if not idle:
        meant = nearest("run", methods, 0.7)
        idle = [] if meant is None or meant in mentioned else [meant]
    if not idle:
        return ""
    return (f"{cls.__name__} has no method `run`, with which a program starts, and nothing starts its method "
            f"`{idle[0]}`; call it `run`")


def _returns_something(code: CodeType) -> bool:
    """Return whether some `return` may return a value other than None, such as the generator of another method."""
    before: Any = None
    for instruction in dis.get_instructions(code):
        if instruction.opname == "RETURN_VALUE" and not (
                before is not None and before.opname == "LOAD_CONST" and before.argval is None):
            return True
        if instruction.opname == "RETURN_CONST" and instruction.argval is not None:
            return True
        before = instruction
    return False


def _names(code: CodeType) -> set[str]:
    """Return every name and attribute that a function mentions, nested functions included."""
    inner = [part for part in code.co_consts if isinstance(part, CodeType)]
    return {*code.co_names, *(name for part in inner for name in _names(part))}
