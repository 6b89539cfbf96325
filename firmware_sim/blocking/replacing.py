"""Replaces names of modules while blocking programs run, and puts them back afterwards.

A replacement acts by the thread that calls it: a thread of a blocking program gets the virtual function, with its
program as the first argument, every other thread the real one. A function kept after the end goes on like that.

Several programs of one process (host `inline`) share the replacements: the last to end puts everything back.
"""

from __future__ import annotations

import sys
import sysconfig
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from inspect import signature
from types import ModuleType
from typing import Any, Final

from firmware_sim.blocking.program_thread import OF_THIS_THREAD

Replacement = tuple[Any, str, Callable[..., Any]]       # (module or class, name, function of program and arguments)
OUR_PACKAGES: Final = frozenset({"agents", "experiments", "firmware_sim", "fmus", "marconet", "netem"})


class Replacements:
    """`constructors` are classes whose `__new__` is replaced, by a function that decides itself whose thread calls.

    `classes` are (module, class): each takes the place of the module's class of its name, in every thread, and its
    construction decides whose thread calls.
    """

    def __init__(self, names: Sequence[Replacement],
                 constructors: Sequence[tuple[type, Callable[..., Any]]] = (),
                 classes: Sequence[tuple[ModuleType, type]] = ()) -> None:
        self._names = names
        self._constructors = constructors
        self._classes = classes
        self._programs = 0
        self._before: list[tuple[Any, str, Any]] = []

    @contextmanager
    def in_place(self, *, everywhere: bool = False) -> Iterator[None]:
        """Within this context the names are replaced.

        With `everywhere` also in installed modules and modules of programs that had imported them (`from time import
        sleep`) before; neither in those of the standard library nor of marconet.
        """
        self._programs += 1
        if self._programs == 1:
            self._replace(everywhere)
        try:
            yield
        finally:
            self._programs -= 1
            if self._programs == 0:
                self._put_back()

    def _replace(self, everywhere: bool) -> None:
        kept: dict[int, tuple[Any, Any]] = {}       # identity of a real function of a module -> (it, its replacement)
        new = [(place, name, by_thread(virtual, getattr(place, name))) for place, name, virtual in self._names]
        new += [(module, cls.__name__, cls) for module, cls in self._classes]
        for place, name, value in new:
            real = getattr(place, name)
            self._set(place, name, value)
            if isinstance(place, ModuleType):
                kept[id(real)] = real, value
        for cls, construct in self._constructors:
            cls.__new__ = construct             # type: ignore[method-assign]
        for module in _importers() if everywhere else ():
            for name, value in list(vars(module).items()):
                if id(value) in kept and kept[id(value)][0] is value:
                    self._set(module, name, kept[id(value)][1])

    def _set(self, place: Any, name: str, value: Any) -> None:
        self._before.append((place, name, getattr(place, name)))
        setattr(place, name, value)

    def _put_back(self) -> None:
        for place, name, real in reversed(self._before):
            setattr(place, name, real)
        self._before.clear()
        for cls, _ in self._constructors:
            del cls.__new__


def by_thread(virtual: Callable[..., Any], real: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that calls `virtual` in threads of blocking programs, `real` in all others."""
    if len(signature(virtual).parameters) == 1:         # the program alone: clocks, which are read most of all
        @wraps(real)
        def either_without_arguments() -> Any:
            program = OF_THIS_THREAD.program
            return real() if program is None else virtual(program)

        return either_without_arguments

    @wraps(real)
    def either(*args: Any, **kwargs: Any) -> Any:
        program = OF_THIS_THREAD.program
        return real(*args, **kwargs) if program is None else virtual(program, *args, **kwargs)

    return either


def _importers() -> Iterator[ModuleType]:
    """Yield the modules that are neither part of the standard library nor of marconet."""
    library = sysconfig.get_path("stdlib"), sysconfig.get_path("platstdlib")
    installed = sysconfig.get_path("purelib"), sysconfig.get_path("platlib")
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if isinstance(file, str) and isinstance(module, ModuleType) and name.partition(".")[0] not in OUR_PACKAGES and (
                file.startswith(installed) or not file.startswith(library)):
            yield module
