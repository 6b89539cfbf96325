"""The error for parts of Zenoh that programs in virtual time do not have, and the arguments that ask for them."""

from __future__ import annotations

from typing import NoReturn

REMEDY = "docs/zenoh_programs.md has what is there; with --real-time the program gets the real library"


class OutsideSubset(NotImplementedError):
    """A part of Zenoh that is not there in virtual time."""


class NoMedium(RuntimeError):
    """No medium of the node carries the Zenoh messages of a key."""


def refuse(what: str) -> NoReturn:
    raise OutsideSubset(f"zenoh: {what} is not there in virtual time; {REMEDY}")


def refuse_given(call: str, **arguments: object) -> None:
    """Raise OutsideSubset for the first argument that is given, that is, not None."""
    for name, value in arguments.items():
        if value is not None:
            refuse(f"{call}: the argument {name}")
