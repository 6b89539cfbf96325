"""Robot programs by import path, and whether a scenario's parameters fit them.

`package.module:Class` is a board's program, `package.module:function` ordinary blocking code.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, Final, get_type_hints

import msgspec

from experiments.scenario.moved_modules import where_it_is
from experiments.scenario.own_modules import NameTaken, module_for
from experiments.scenario.problems import Place, near
from experiments.scenario.program_run import complaint_about_run
from experiments.scenario.shape import Shape
from experiments.scenario.table_reader import TableReader
from experiments.scenario.units import spellings

NO_PROGRAM: Final = {
    inspect.iscoroutinefunction: "is a coroutine, and asyncio does not run in virtual time; write blocking code",
    inspect.isgeneratorfunction: "is a generator, which nobody would iterate; write blocking code, or a class whose "
                                 "method `run` yields",
}


def import_program(program: str, folder: Path) -> Callable[..., Any]:
    """The class or function. A module is looked for in `folder`, that of the scenario, then where it is installed.

    ValueError says what is wrong with the path; what the module's own code raises comes through.
    """
    module_name, colon, class_name = program.partition(":")
    parts = module_name.split(".")
    if not colon or not class_name.isidentifier() or not all(part.isidentifier() for part in parts):
        raise ValueError("expected 'package.module:Class' or 'package.module:function'")
    try:
        module = module_for(module_name, folder)
    except NameTaken as error:
        raise ValueError(str(error)) from error
    except ModuleNotFoundError as error:
        if error.name is None or not (module_name == error.name or module_name.startswith(error.name + ".")):
            moved = where_it_is(error.name or "")
            raise ValueError(f"{module_name} needs the module {error.name!r}, which is not "
                             f"{'there any more' + moved if moved else 'installed'}") from error
        raise ValueError(f"there is no module {error.name!r}; {_near_module(error.name, folder)}") from error
    found = getattr(module, class_name, None)
    if not callable(found):
        programs = [name for name, value in vars(module).items() if callable(value)]
        what = "is no class or function" if found is not None else f"is not in {module_name}"
        raise ValueError(f"{class_name} {what}; {near(class_name, programs)}")
    for is_one, why_not in NO_PROGRAM.items():
        if is_one(found):
            raise ValueError(f"{class_name} {why_not}")
    program_found: Callable[..., Any] = found
    return program_found


def check_program(program: str, parameters: dict[str, Any], place: Place,
                  tables: TableReader) -> tuple[Callable[..., Any] | None, dict[str, Any]]:
    """The program and its keyword arguments with times in ns; problems at `place`, that of the agent."""
    problems = tables.problems
    try:
        cls = import_program(program, tables.folder)
    except ValueError as error:
        problems.add((*place, "program"), str(error), program)
        return None, parameters
    except Exception as error:
        problems.add((*place, "program"), f"importing it failed: {type(error).__name__}: {error}", program)
        return None, parameters
    if isinstance(cls, type) and (complaint := complaint_about_run(cls)):
        problems.add((*place, "program"), complaint, program)
        return None, parameters
    shape, complaint = _keywords(cls)
    if complaint:
        problems.add((*place, "program"), complaint, program)
        return None, parameters
    if shape is None:
        return cls, parameters
    filled = tables.read(shape, parameters, (*place, "parameters"))
    for name, value in filled.values.items():
        if name.endswith("period_ns") and (complaint := _period_complaint(cls, name, value)):
            key = next(key for key in spellings(name) if key in parameters)
            problems.add((*place, "parameters", key), complaint, parameters[key])
    return cls, msgspec.to_builtins(filled.values, enc_hook=str)


def _period_complaint(cls: Callable[..., Any], name: str, value: Any) -> str:
    """A period is more than 0, or 0 for "never" where the program's own default says so; "" if this one is."""
    if not (name == "period_ns" or name.endswith("_period_ns")) or not isinstance(value, int):
        return ""
    may_be_0 = inspect.signature(cls).parameters[name].default == 0
    if value > 0 or (value == 0 and may_be_0):
        return ""
    return (f"expected {'>= 0' if may_be_0 else '> 0'}; a program that waits for its next period would never get past "
            "the first instant")


def _keywords(cls: Callable[..., Any]) -> tuple[Shape | None, str]:
    """What the class takes after the board, or the function at all (None: any keyword); what is wrong with it."""
    try:
        signature = inspect.signature(cls)
    except ValueError:
        return None, f"{cls.__name__} does not say what it takes; write the program in Python"
    if not isinstance(cls, type):
        return _parameters(cls, list(signature.parameters.values()))
    positional = [item for item in signature.parameters.values()
                  if item.kind in (item.POSITIONAL_ONLY, item.POSITIONAL_OR_KEYWORD)]
    if not positional and not any(item.kind is item.VAR_POSITIONAL for item in signature.parameters.values()):
        return None, f"takes no board: {cls.__name__}{signature} has no positional argument"
    return _parameters(inspect.getattr_static(cls, "__init__"),
                       [item for item in signature.parameters.values() if item not in positional[:1]])


def _parameters(function: Any, given: list[inspect.Parameter]) -> tuple[Shape | None, str]:
    named = [item for item in given if item.kind in (item.POSITIONAL_OR_KEYWORD, item.KEYWORD_ONLY)]
    if any(item.kind is item.VAR_KEYWORD for item in given):
        return None, ""
    try:
        hints = get_type_hints(function, include_extras=True)
    except (NameError, TypeError):
        hints = {}
    return Shape({item.name: hints.get(item.name, Any) for item in named},
                 frozenset(item.name for item in named if item.default is item.empty)), ""


def _near_module(name: str, folder: Path) -> str:
    parent, _, last = name.rpartition(".")
    if parent:
        paths: Iterable[str] = getattr(sys.modules.get(parent), "__path__", [])
        return near(name, [f"{parent}.{module.name}" for module in iter_modules(paths)])
    own = [module.name for module in iter_modules([str(folder.absolute())])]
    return near(last, ["agents", "firmware_sim", *own])
