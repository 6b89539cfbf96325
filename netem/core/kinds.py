"""A table of kinds that imports a member's class when it is first looked up.

    MEDIA = Kinds({"can": "netem.media.can.bus:CanBus", ...})
    "can" in MEDIA, list(MEDIA)         # the names, without an import
    MEDIA["can"]                        # the class

A scenario uses few kinds, and a command does not import the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any


class Kinds(Mapping[str, Any]):
    """`paths` maps the name of each kind to "package.module:Class"."""

    def __init__(self, paths: Mapping[str, str]) -> None:
        self._paths = dict(paths)

    def __getitem__(self, kind: str) -> Any:
        module, _, name = self._paths[kind].partition(":")
        return getattr(import_module(module), name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)
