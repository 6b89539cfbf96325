"""Converts values to types that only users' programs have, such as `Decimal` or a pydantic model, by pydantic."""

from __future__ import annotations

import json
from functools import cache
from typing import Any, Final

from experiments.scenario.problems import Place

RULES: Final = {"int_type": "expected a whole number", "float_type": "expected a number",
                "string_type": "expected text in quotes", "bool_type": "expected true or false"}


def judge(hint: Any, value: Any) -> tuple[Any, list[tuple[Place, str, Any]]]:
    """Return `value` converted to the type `hint`, and its problems as (place within it, rule, value there)."""
    from pydantic import ValidationError  # late: it takes 0.1 s, and our own types do not need it

    adapter = _adapter(hint)
    if adapter is None:
        return value, []
    try:
        return adapter.validate_json(json.dumps([value]), strict=True)[0], []
    except ValidationError as error:
        return value, [_complaint(item, value) for item in error.errors(include_url=False)]


@cache
def _adapter(hint: Any) -> Any:
    """Return an adapter for a list with one `hint`, which may have its own configuration; None for unknown types."""
    from pydantic import TypeAdapter
    from pydantic.errors import PydanticSchemaGenerationError

    try:
        return TypeAdapter(list[hint], config={"arbitrary_types_allowed": True, "allow_inf_nan": False})
    except PydanticSchemaGenerationError:
        return None


def _complaint(item: Any, value: Any) -> tuple[Place, str, Any]:
    path: Place = ()
    for part in item["loc"][1:]:            # skips the names of a union's members
        if (isinstance(value, dict) and part in value) or (isinstance(value, list) and part in range(len(value))):
            path, value = (*path, part), value[part]
    if item["type"] in ("too_short", "too_long") and "actual_length" in item["ctx"]:
        bound, limit = ("least", "min_length") if item["type"] == "too_short" else ("most", "max_length")
        return path, f"expected at {bound} {item['ctx'][limit]} entries, found {item['ctx']['actual_length']}", value
    text = str(item["msg"]).replace("Input should be", "expected")
    return path, RULES.get(item["type"], text[:1].lower() + text[1:]), value
