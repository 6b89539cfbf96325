"""Writes a value in TOML on one line, as the option `--set` takes it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def toml_text(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml_text(part)}" for key, part in value.items()) + "}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_text, value))}]"
    return json.dumps(value, ensure_ascii=False)


def set_options(values: Mapping[str, Any]) -> list[str]:
    """Return the words of a command that set `values` by path."""
    return [word for path, value in values.items() for word in ("--set", f"{path}={toml_text(value)}")]
