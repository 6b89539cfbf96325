"""What a form needs to know to inject a fault: kinds, what they can be about, and their keys.

Keys, units and defaults are those of `[[faults]]`, read from the classes of the kinds, so a new kind is in the form.
"""

from __future__ import annotations

import sys
import types
from collections.abc import Iterator, Sequence
from dataclasses import MISSING, fields
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from experiments.scenario.shape import shape_of
from experiments.scenario.toml_text import toml_text
from experiments.scenario.units import spellings
from netem.faults import Fault, Site
from netem.faults.table import FAULTS

Json = dict[str, Any]
UNIT: Final = "s"                           # in which a time is asked for
SET_BY_INJECTION: Final = "spares_under_way"
MOST_TARGETS: Final = 2000
PLURALS: Final = ("nodes", "media", "links")


def fault_form(site: Site) -> list[Json]:
    """Return the kinds of faults that something at `site` can take, each with the keys that it is given by."""
    return [_kind(name, cls, targets, _names(cls, targets[0], site)) for name, cls in FAULTS.items()
            if (targets := cls.targets(site))]


def keys_of(kind: str) -> set[str]:
    """Return every key that a fault of this kind may have, {} of an unknown one."""
    return set(shape_of(FAULTS[kind]).keys()) | {"on", "name", "lasts_s"} if kind in FAULTS else set()


def _names(cls: type[Fault], target: str, site: Site) -> list[str]:
    """Return the nodes that an example of a value may name."""
    return list(site.nodes_on[target] if cls.on == "media" else site.nodes)


def _kind(name: str, cls: type[Fault], targets: list[str], names: list[str]) -> Json:
    about = (sys.modules[cls.__module__].__doc__ or "").partition("\n")[0]
    lasts = [_field("lasts_s", int | None, required=False, default="", unit=UNIT)] if cls.lasting else []
    return {"kind": name, "about": about, "on": cls.on, "targets": targets[:MOST_TARGETS], "lasting": cls.lasting,
            "fields": [*lasts, *_fields(cls, names)]}


def _fields(cls: Any, names: list[str]) -> Iterator[Json]:
    shape = shape_of(cls)
    for item in fields(cls):
        if item.name not in shape.hints or item.name == SET_BY_INJECTION:
            continue
        key, unit = (f"{item.name.removesuffix('_ns')}_{UNIT}", UNIT) if spellings(item.name) else (item.name, "")
        default = cls.unset.get(item.name, "") if item.default in (MISSING, None, ()) else _text(item.default, unit)
        yield _field(key, shape.hints[item.name], required=item.name in shape.required, default=default, unit=unit,
                     names=names)


def _text(value: Any, unit: str) -> str:
    if unit:
        return f"{value / 1e9:g}"
    return value if isinstance(value, str) else toml_text(value)


def _field(key: str, hint: Any, *, required: bool, default: str, unit: str, names: Sequence[str] = ()) -> Json:
    return {"key": key, "unit": unit, "required": required, "default": default, "options": _options(hint),
            "example": _example(hint, names)}


def _example(hint: Any, names: Sequence[str]) -> str:
    """Return how a value that is a list is written, "" for any other."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return next(filter(None, (_example(part, names) for part in parts)), "")
    if origin is not tuple:
        return ""
    if get_origin(parts[0]) is tuple:
        return toml_text([[*names[:1]], [*names[1:]]])
    return toml_text([*names[:1]] if parts[0] is str else [0.0, 1.0])


def _options(hint: Any) -> list[str]:
    """Return the words that a value can be; [] if it is anything else."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _options(parts[0])
    if origin in (Union, types.UnionType):
        known = [_options(part) for part in parts if part is not type(None)]
        return known[0] if len(known) == 1 else []
    if origin is Literal:
        return [str(part) for part in parts]
    return ["true", "false"] if hint is bool else []
