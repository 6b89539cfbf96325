"""Finds the class that the `kind` of an impairment names: a name in the table, or an import path `module:Class`.

An author's class is found as programs are and keeps the contract of `netem.impairments`: a dataclass whose fields are
its TOML keys (a field `rng` of type `random.Random` is its random stream), a method `carry` and a constant `loses_as`.
"""

from __future__ import annotations

from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, Final

from experiments.scenario.program import import_program
from experiments.scenario.shape import shape_of
from netem.impairments.contract import complaint_about
from netem.impairments.table import IMPAIRMENTS

KEYS_OF_EVERY_KIND: Final = ("on", "during_ns", "kind", "name", "shared")


def impairment_class(kind: str, folder: Path) -> Any:
    """Return the class of a kind in a scenario that was loaded from `folder`."""
    return IMPAIRMENTS[kind] if kind in IMPAIRMENTS else import_impairment(kind, folder)


def import_impairment(path: str, folder: Path) -> type:
    """Return the author's class; ValueError with the reason if the path or the class is wrong."""
    cls = import_program(path, folder)
    if not is_dataclass(cls):
        raise ValueError(f"{cls.__name__} is no dataclass; write @dataclass above it, its fields are the keys here")
    if complaint := complaint_about(cls):
        raise ValueError(complaint)
    try:
        shape = shape_of(cls)
    except (NameError, TypeError) as error:
        raise ValueError(f"the types of {cls.__name__}'s fields are not known: {error}") from error
    taken = [key for key in KEYS_OF_EVERY_KIND if key in shape.hints]
    if taken:
        raise ValueError(f"{cls.__name__} has a field {taken[0]!r}, a key that every impairment has already; "
                         "rename the field")
    return cls
