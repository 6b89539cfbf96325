"""Makes the JSON Schema of a scenario, for editors, from the classes and types with which scenarios are read.

With it an editor completes keys and marks wrong ones. `marconet check` also checks names, units that contradict each
other, rules between keys, and programs; it refuses every document that the schema refuses.

Every time `x_ns` may be written `x_s`, `x_ms`, `x_us` or `x_ns`, a number of that unit. The schema is of draft 7, which
Taplo reads.
"""

from __future__ import annotations

import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt

from experiments.scenario import derived
from experiments.scenario.agents import AgentTable
from experiments.scenario.cost_kinds import COSTS
from experiments.scenario.expect import SHAPE as EXPECTED
from experiments.scenario.faults import FaultHeader
from experiments.scenario.gateways import GatewayHeader
from experiments.scenario.guarantee_kinds import MONITORS
from experiments.scenario.guarantees import GuaranteeHeader
from experiments.scenario.loader import Header
from experiments.scenario.network import ImpairmentHeader
from experiments.scenario.records import on_request
from experiments.scenario.shape import Shape, shape_of
from experiments.scenario.units import spellings
from netem.faults.table import FAULTS
from netem.gateways.network_settings import NetworkSettings
from netem.gateways.real_time_settings import RealTimeSettings
from netem.gateways.table import GATEWAYS, USUAL
from netem.impairments.table import IMPAIRMENTS
from netem.media.table import MEDIA
from netem.records.table import RECORDERS

Schema = dict[str, Any]
_PLAIN: Final[Mapping[Any, Schema]] = {
    int: {"type": "integer"}, float: {"type": "number"}, str: {"type": "string"}, bool: {"type": "boolean"},
    type(None): {"type": "null"}, Path: {"type": "string"}, dict: {"type": "object"}}
_LIMITS: Final = {Ge: ("ge", "minimum"), Gt: ("gt", "exclusiveMinimum"), Le: ("le", "maximum"),
                  Lt: ("lt", "exclusiveMaximum")}
NAMES: Final = {"pattern": "^[A-Za-z][A-Za-z0-9_-]*$"}
ABOUT: Final = {
    "team": "data that all programs can read as board.team",
    "agents": "the nodes: each a program with its clock, plant and position",
    "agents_defaults": "default values of every agent",
    "media": "the networks that carry frames between the agents",
    "gateways": "connections to devices and programs outside the run, in real time",
    "network": "how the doors of a run are locked",
    "real_time": "pace of a run in real time, and what happens when it is late",
    "impairments": "losses, delays and errors on links, applied in this order",
    "faults": "what breaks and when: nodes, clocks, links",
    "derived": "signals computed from recorded ones after the run",
    "guarantees": "requirements that have to hold at every instant",
    "costs": "figures that grow with time, such as energy",
    "records": "recorders of this run, besides those of every run",
    "expect": "bounds on figures, and formulas of temporal logic, judged at the end of the run",
}


def scenario_schema() -> Schema:
    header = _table(shape_of(Header))
    impairments: Mapping[str, Any] = IMPAIRMENTS
    sections: Schema = {
        "team": {"type": "object"},
        "agents": _named(_table(shape_of(AgentTable), complete=False)),
        "agents_defaults": _table(shape_of(AgentTable), complete=False),
        "media": _named(_kinds({kind: shape_of(cls.Settings) for kind, cls in MEDIA.items()})),
        "gateways": _named(_kinds({kind: shape_of(cls.Settings) for kind, cls in GATEWAYS.items()},
                                  shape_of(GatewayHeader), usual=USUAL)),
        "network": _table(shape_of(NetworkSettings)),
        "real_time": _table(shape_of(RealTimeSettings)),
        "impairments": {"type": "array", "items": _kinds(
            {kind: shape_of(cls) for kind, cls in impairments.items()}, shape_of(ImpairmentHeader),
            own_classes=True)},
        "faults": {"type": "array", "items": _kinds({kind: shape_of(cls) for kind, cls in FAULTS.items()},
                                                    shape_of(FaultHeader))},
        "derived": _named(_table(shape_of(derived.Table))),
        "guarantees": _named(_kinds({kind: shape_of(cls) for kind, cls in MONITORS.items()},
                                    shape_of(GuaranteeHeader))),
        "costs": _named(_kinds({kind: shape_of(cls) for kind, cls in COSTS.items()})),
        "records": {"type": "object", "additionalProperties": False,
                    "properties": {kind: _table(shape_of(RECORDERS[kind].Settings)) for kind in on_request()}},
        "expect": {"type": "object", "additionalProperties": {"anyOf": [{"type": "string"}, _table(EXPECTED)]}},
    }
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "A scenario of marconet",
        **header,
        "properties": {**header["properties"],
                       **{key: {"description": ABOUT[key], **schema} for key, schema in sections.items()}},
        "required": [*header.get("required", []), "agents"],
    }


def _named(table: Schema) -> Schema:
    return {"type": "object", "propertyNames": NAMES, "additionalProperties": table}


def _table(shape: Shape, *, complete: bool = True, kind: Schema | None = None) -> Schema:
    """Return the schema of a table; `complete` requires its required fields, `kind` is the schema of the key `kind`."""
    properties: Schema = {} if kind is None else {"kind": kind}
    required = [] if kind is None else ["kind"]
    one_of_each: list[Schema] = []
    for name, hint in shape.hints.items():
        if name in properties:
            continue                # `kind`, which a header has as any text
        keys = spellings(name)
        for key in keys:
            properties[key] = _of(hint, time=True, complete=complete)
        if not keys:
            properties[name] = _of(hint, complete=complete)
        if complete and name in shape.required:
            if keys:
                one_of_each.append({"anyOf": [{"required": [key]} for key in keys]})
            else:
                required.append(name)
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    if required:
        schema["required"] = required
    if one_of_each:
        schema["allOf"] = one_of_each
    return schema


def _kinds(shapes: Mapping[str, Shape], common: Shape | None = None, *, own_classes: bool = False,
           usual: str = "") -> Schema:
    """Return the schema of a table whose key `kind` selects one of the shapes, each with the fields of `common`.

    A table without the key has the shape `usual`. With `own_classes`, `kind` may also be an import path.
    """
    more = Shape({}, frozenset()) if common is None else common
    tables = [_table(Shape({**more.hints, **shape.hints}, more.required | shape.required), kind={"const": kind})
              for kind, shape in shapes.items()]
    if usual:
        tables[list(shapes).index(usual)]["required"].remove("kind")
    if own_classes:
        table = _table(more, kind={"type": "string", "pattern": ":"})
        tables.append({**table, "additionalProperties": True})
    return {"oneOf": tables}


def _of(hint: Any, time: bool = False, complete: bool = True) -> Schema:
    """Return the schema of a type. With `time` an int is written as a number of another unit; `complete` as above."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        schema = _of(parts[0], time, complete)
        for mark in parts[1:]:
            if type(mark) in _LIMITS:
                attribute, keyword = _LIMITS[type(mark)]
                schema = {**schema, keyword: getattr(mark, attribute)}
        return schema
    if hint is int and time:
        return {"type": "number"}
    if isinstance(hint, type) and hint in _PLAIN:
        return dict(_PLAIN[hint])
    if origin in (Union, types.UnionType):
        return _any_of(_of(part, time, complete) for part in parts if part is not type(None))
    if origin is Literal:
        return {"enum": list(parts)}
    if origin is tuple and parts and parts[-1] is not Ellipsis:
        return {"type": "array", "items": [_of(part, time, complete) for part in parts], "minItems": len(parts),
                "maxItems": len(parts)}
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return {"type": "object", "additionalProperties": _of(parts[1], time, complete)}
    if isinstance(origin, type) and issubclass(origin, Sequence | set | frozenset):
        return {"type": "array", "items": _of(parts[0], time, complete)}
    if isinstance(hint, type) and is_dataclass(hint):
        return _table(shape_of(hint), complete=complete)
    return {}


def _any_of(schemas: Iterable[Schema]) -> Schema:
    found = list(schemas)
    return found[0] if len(found) == 1 else {"anyOf": found}
