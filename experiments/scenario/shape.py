"""The keys that a table of the file may have: the fields of a dataclass, without those that marconet passes in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache, cached_property
from random import Random
from typing import Any, Final, get_type_hints

from experiments.scenario.units import spellings
from netem.impairments.recordings import Recordings

PASSED_IN: Final = (Random, Recordings)


@dataclass(frozen=True)
class Shape:
    """The fields that a table may have, with their type hints, and the required ones."""

    hints: Mapping[str, Any]
    required: frozenset[str]

    @cached_property
    def field_of(self) -> dict[str, tuple[str, str]]:
        """Maps each key that an author may write to (field, unit of time or "")."""
        return {key: (name, unit) for name in self.hints for key, unit in (spellings(name) or {name: ""}).items()}

    def keys(self) -> list[str]:
        return list(self.field_of)


@cache
def shape_of(cls: type) -> Shape:
    """Return the shape of a dataclass, without its random stream and recordings, which marconet passes in."""
    hints = get_type_hints(cls, include_extras=True)
    own = [item for item in fields(cls) if item.init and hints[item.name] not in PASSED_IN]
    return Shape({item.name: hints[item.name] for item in own},
                 frozenset(item.name for item in own if item.default is MISSING and item.default_factory is MISSING))
