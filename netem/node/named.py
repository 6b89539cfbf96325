"""A mapping by name whose KeyError names the nearest key, or all keys.

    node.ports["radi"]      KeyError: r1 has no port 'radi'; did you mean 'radio'?
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn, TypeVar

from netem.core.nearest import did_you_mean

Value = TypeVar("Value")


class UnknownName(KeyError):
    """A key is missing. Its `str` is the message itself, where KeyError would quote it."""

    def __str__(self) -> str:
        return str(self.args[0])


class Named(dict[str, Value]):
    """`owner` ("r1") and `what` ("port") go into the message; `if_empty` is its remedy if the mapping is empty."""

    def __init__(self, entries: Mapping[str, Value], owner: str, what: str, if_empty: str) -> None:
        super().__init__(entries)
        self._owner, self._what, self._if_empty = owner, what, if_empty

    def __missing__(self, name: Any) -> NoReturn:
        raise UnknownName(f"{self._owner} has no {self._what} {name!r}; {self._remedy(str(name))}")

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (dict(self),)

    def _remedy(self, name: str) -> str:
        if not self:
            return self._if_empty
        all_names = ("there are " if len(self) > 1 else "there is only ") + ", ".join(map(repr, self))
        return did_you_mean(name, self, all_names, cutoff=0.5)
