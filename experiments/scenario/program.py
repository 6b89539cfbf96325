"""Imports robot programs by path and checks their signatures and the parameters that a scenario gives them.

`package.module:Class` is a board's program, `package.module:function` ordinary blocking code; it may be a coroutine.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable
from dataclasses import is_dataclass
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, Final, cast, get_type_hints

import msgspec

from experiments.programs.firmware_programs import firmware_class_for, is_firmware
from experiments.programs.own_modules import NameTaken, module_for
from experiments.scenario.moved_modules import where_it_is
from experiments.scenario.problems import Place, near
from experiments.scenario.program_run import complaint_about_run
from experiments.scenario.refusals import refuse
from experiments.scenario.shape import Shape, shape_of
from experiments.scenario.table_reader import TableReader
from experiments.scenario.units import spellings
from firmware_sim.program_settings import settings_class

NO_PROGRAM: Final = {
    inspect.isasyncgenfunction: "is an asynchronous generator, which nobody would iterate; write a coroutine",
    inspect.isgeneratorfunction: "is a generator, which nobody would iterate; write blocking code, or a class whose "
                                 "method `run` yields",
}
_OF_A_SCENARIO: Final = ("scenario", "own"), "where `own` holds the agents that run this program, with their settings"
QUESTIONS: Final = (
    ("check", *_OF_A_SCENARIO), ("prepare", *_OF_A_SCENARIO), ("charts", *_OF_A_SCENARIO),
    ("automaton", ("settings", "team"), "which returns the hybrid automaton of an agent with these settings"),
    ("ground_plan", ("settings", "team"), "which returns the ground on which an agent with these settings acts"))


def import_program(program: str, folder: Path) -> Callable[..., Any]:
    """Return the class or function; its module is looked for in `folder`, the scenario's, then among those installed.

    Raises ValueError with the reason if the path is wrong, and any exception of the module's own code.
    """
    if is_firmware(program):
        return cast(Callable[..., Any], firmware_class_for(program, folder))
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


def check_program(program: str, parameters: dict[str, Any], place: Place, tables: TableReader, key: str = "program",
                  written: str = "") -> tuple[Callable[..., Any] | None, dict[str, Any], Any]:
    """Return the program, its parameters with times in ns, and its `Settings` (None without or with wrong ones).

    Problems are added at `place`, that of the agent, about its `key`, which the author has `written`; then the program
    may be None.
    """
    problems, written = tables.problems, written or program
    try:
        cls = import_program(program, tables.folder)
    except ValueError as error:
        problems.add((*place, key), str(error), written)
        return None, parameters, None
    except Exception as error:
        problems.add((*place, key), f"importing it failed: {type(error).__name__}: {error}", written)
        return None, parameters, None
    if isinstance(cls, type) and (complaint := complaint_about_run(cls)):
        problems.add((*place, key), complaint, written)
        return None, parameters, None
    shape, complaint = parameters_of(cls)
    if complaint:
        problems.add((*place, key), complaint, written)
        return None, parameters, None
    if shape is None:
        return cls, parameters, None
    place = (*place, "parameters")
    before = problems.found
    values = tables.read(shape, parameters, place).values
    for name, value in values.items():
        if name.endswith("period_ns") and (complaint := _period_complaint(cls, name, value)):
            key = next(key for key in spellings(name) if key in parameters)
            problems.add((*place, key), complaint, parameters[key])
    settings = None
    if problems.found == before and (declared := settings_class(cls)) is not None:
        try:
            settings = declared(**values)
        except (ValueError, ArithmeticError, TypeError, LookupError) as error:
            refuse(error, parameters, place, problems)
    return cls, msgspec.to_builtins(values, enc_hook=str), settings


def _period_complaint(cls: Callable[..., Any], name: str, value: Any) -> str:
    """Return a problem of a period, "" if there is none: it is above 0, or 0 ("never") if that is the default."""
    if not (name == "period_ns" or name.endswith("_period_ns")) or not isinstance(value, int):
        return ""
    may_be_0 = inspect.signature(settings_class(cls) or cls).parameters[name].default == 0
    if value > 0 or (value == 0 and may_be_0):
        return ""
    return (f"expected {'>= 0' if may_be_0 else '> 0'}; a program that waits for its next period would never get past "
            "the first instant")


def parameters_of(program: Callable[..., Any]) -> tuple[Shape | None, str]:
    """Return the keys of `parameters` and a problem of the program or "".

    The keys are the fields of a class's `Settings`, or a function's arguments; None: any keyword.
    """
    try:
        given = list(inspect.signature(program).parameters.values())
    except ValueError:
        return None, f"{program.__name__} does not say what it takes; write the program in Python"
    if not isinstance(program, type):
        return _arguments(program, given)
    declared: Any = getattr(program, "Settings", None)
    if declared is not None and not (isinstance(declared, type) and is_dataclass(declared)):
        return None, f"{program.__name__}.Settings is no dataclass"
    positional = [item.name for item in given if item.kind in (item.POSITIONAL_ONLY, item.POSITIONAL_OR_KEYWORD)]
    besides = positional[1:] + [item.name for item in given if item.kind is item.KEYWORD_ONLY]
    if besides and declared is None:
        return None, (f"{program.__name__} takes {', '.join(besides)} besides the board: declare them as fields of a "
                      f"dataclass `Settings` of the class, and write __init__(self, board, settings)")
    takes = ["board"] if declared is None else ["board", "settings"]
    try:
        inspect.signature(program).bind(*takes)
    except TypeError:
        here = f"{program.__name__}{inspect.signature(program)}"
        if not positional:
            return None, f"takes no board: {here} has no positional argument"
        return None, f"{here}: expected {program.__name__}({', '.join(takes)})"
    if complaint := _complaint_about_questions(program):
        return None, complaint
    try:
        return (Shape({}, frozenset()) if declared is None else shape_of(declared)), ""
    except NameError as error:
        return None, f"{program.__name__}.Settings: {error}"


def _complaint_about_questions(program: type) -> str:
    """Return a problem of the signature of one of the `QUESTIONS`, "" if there is none."""
    for name, given, meaning in QUESTIONS:
        asked: Callable[..., Any] | None = getattr(program, name, None)
        if asked is None:
            continue
        try:
            inspect.signature(asked).bind(*given)
        except TypeError:
            here = f"{program.__name__}.{name}{inspect.signature(asked)}"
            return f"{here}: expected {name}({', '.join(given)}), {meaning}"
    return ""


def _arguments(function: Any, given: list[inspect.Parameter]) -> tuple[Shape | None, str]:
    """Return the same as `parameters_of`, for a blocking function."""
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
