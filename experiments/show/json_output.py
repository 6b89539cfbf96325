"""JSON documents on standard output; their shapes are stable and described in docs/command_line.md."""

from __future__ import annotations

from typing import Any

import msgspec


def as_text(value: Any) -> str:
    return msgspec.json.format(msgspec.json.encode(value, enc_hook=str), indent=2).decode()


def print_json(value: Any) -> None:
    print(as_text(value), flush=True)
