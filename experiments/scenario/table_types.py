"""Types of a prepared table: pydantic judges what is not plainly right, in our words and at our places."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from experiments.scenario.plain_types import plain_values
from experiments.scenario.problems import Place, near, nearest, value_text
from experiments.scenario.refusals import refuse
from experiments.scenario.shape import Shape
from experiments.scenario.table_names import Prepared

if TYPE_CHECKING:
    from pydantic import BaseModel, ConfigDict, ValidationError

_CONFIG: Final[ConfigDict] = {"extra": "forbid", "strict": True, "allow_inf_nan": False,
                              "arbitrary_types_allowed": True, "protected_namespaces": ()}


def typed(shape: Shape, prepared: Prepared, ready: Mapping[str, Any]) -> dict[str, Any]:
    """Values of the right types; a field with a problem is left out."""
    if not prepared.wrong and (plain := plain_values(shape, ready)) is not None:
        return plain
    from pydantic import ValidationError  # late: a correct scenario does without it

    model = _model(shape)
    try:
        values = _values(model, ready)
    except ValidationError as error:
        _translate(prepared, error, ready)
        prepared.wrong.update(item["loc"][0] for item in error.errors())
        values = _values(model, {name: value for name, value in ready.items() if name not in prepared.wrong})
    return {name: value for name, value in values.items() if name not in prepared.wrong}


def _values(model: type[BaseModel], ready: Mapping[str, Any]) -> dict[str, Any]:
    table = model.model_validate_json(json.dumps(ready), strict=True)
    return {info.alias: getattr(table, name) for name, info in model.model_fields.items()
            if name in table.model_fields_set and info.alias is not None}


def _model(shape: Shape) -> type[BaseModel]:
    """A pydantic model of the fields; which of them must be there has been said before."""
    from pydantic import Field, create_model
    from pydantic.errors import PydanticSchemaGenerationError

    def model(hints: Mapping[str, Any]) -> type[BaseModel]:
        columns: dict[str, Any] = {f"field_{index}": (hint, Field(default=None, alias=name))
                                   for index, (name, hint) in enumerate(hints.items())}
        return create_model("Table", __config__=_CONFIG, **columns)

    try:
        return model(shape.hints)
    except PydanticSchemaGenerationError:
        return model({name: hint if _has_schema(hint) else Any for name, hint in shape.hints.items()})


def _has_schema(hint: Any) -> bool:
    from pydantic import create_model
    from pydantic.errors import PydanticSchemaGenerationError

    try:
        create_model("Table", __config__=_CONFIG, field=(hint, None))
    except PydanticSchemaGenerationError:
        return False
    return True


_TYPE_RULES = {
    "int_type": "expected a whole number", "int_from_float": "expected a whole number",
    "float_type": "expected a number", "string_type": "expected text in quotes", "bool_type": "expected true or false",
    "list_type": "expected a list", "tuple_type": "expected a list", "set_type": "expected a list",
    "frozen_set_type": "expected a list", "dict_type": "expected a table", "model_type": "expected a table",
    "dataclass_type": "expected a table", "dataclass_exact_type": "expected a table", "none_required": "",
    "finite_number": "expected a finite number", "path_type": "expected a path in quotes",
}
_LIMITS = {"greater_than": (">", "gt"), "greater_than_equal": (">=", "ge"), "less_than": ("<", "lt"),
           "less_than_equal": ("<=", "le")}


def _translate(prepared: Prepared, error: ValidationError, ready: Mapping[str, Any]) -> None:
    """Pydantic's errors in our words; several for one place are the members of a union, any of which would do."""
    rules: dict[Place, list[str]] = {}
    for item in error.errors(include_url=False):
        path, foreign = _locate(prepared, item["loc"], ready)
        if foreign:
            continue
        if item["type"] == "missing":               # said by `prepare_table`, with its spellings
            continue
        if item["type"] in ("union_tag_invalid", "union_tag_not_found"):
            _translate_kind(prepared, item, path)
            continue
        if item["type"] == "value_error":
            refuse(item["ctx"]["error"], _at(prepared, path), prepared.place_of(path), prepared.problems)
            continue
        rules.setdefault(path, []).append(_rule(item))
    for path, said in rules.items():
        rule = " or ".join(dict.fromkeys(text for text in said if text))
        value = prepared.raw.get(path, _value(ready, path))
        for name in _choices(said):
            if (guess := nearest(value, name)) is not None:
                rule += f"; did you mean {value_text(guess)}?"
        prepared.problems.add(prepared.place_of(path), rule.replace(" or expected ", " or "), value)
    if prepared.problems.found == prepared.found_before:
        prepared.problems.add(prepared.place, str(error).replace("\n", " "))


def _translate_kind(prepared: Prepared, item: Mapping[str, Any], path: Place) -> None:
    """A union whose members are told apart by a key, mostly `kind`."""
    key = item["ctx"]["discriminator"].strip("'")
    place = prepared.place_of((*path, key))
    if item["type"] == "union_tag_not_found":
        prepared.problems.add(place, "is missing")
        return
    known = [tag.strip(" '") for tag in item["ctx"]["expected_tags"].split(",")]
    prepared.problems.add(place, f"no such {key}; {near(item['ctx']['tag'], known)}", item["ctx"]["tag"])


def _rule(item: Mapping[str, Any]) -> str:
    kind = item["type"]
    if kind in _TYPE_RULES:
        return _TYPE_RULES[kind]
    if kind in _LIMITS:
        sign, limit = _LIMITS[kind]
        return f"expected {sign} {item['ctx'][limit]:g}"
    if kind in ("enum", "literal_error"):
        return f"expected {item['ctx']['expected']}"
    if kind in ("too_long", "too_short") and "actual_length" in item["ctx"]:
        limit = "least" if kind == "too_short" else "most"
        entries = item["ctx"]["min_length" if kind == "too_short" else "max_length"]
        return f"expected at {limit} {entries} entries, found {item['ctx']['actual_length']}"
    text = str(item["msg"]).replace("Input should be", "expected")
    return text[:1].lower() + text[1:]


def _choices(rules: Sequence[str]) -> list[list[str]]:
    found = [re.findall(r"'([^']*)'", rule) for rule in rules]
    return [names for names in found if names][:1]


def _locate(prepared: Prepared, loc: tuple[str | int, ...], ready: Any) -> tuple[Place, bool]:
    """The path of a pydantic location without the names of union members, and whether it is about another member."""
    path: Place = ()
    value = ready
    for part in loc:
        if (isinstance(value, dict) and part in value) or (isinstance(value, list) and isinstance(part, int)
                                                            and part < len(value)):
            path = (*path, part)
            value = value[part]             # type: ignore[index]
        elif path in prepared.chosen and part not in prepared.chosen[path]:
            return path, True
    return path, False


def _value(value: Any, path: Place) -> Any:
    for part in path:
        value = value[part]
    return value


def _at(prepared: Prepared, path: Place) -> Any:
    """The table at a path, as written."""
    value: Any = prepared.raw
    for end in range(len(path), 0, -1):
        if path[:end] in prepared.raw:
            value = prepared.raw[path[:end]]
            for part in path[end:]:
                value = value[part]
            return value
    return value
