"""Zenoh's key expressions: which are valid, and which keys one includes, without the library.

    chunk     text without `/ * $ ? #`, `*` for any chunk, or text with `$*` in it for any part of a chunk
    `**`      any number of chunks, also none; neither it nor `*` stands for a chunk that begins with `@`

Source: Zenoh's RFC "Key Expressions" (eclipse-zenoh/roadmap, rfcs/ALL/Key Expressions.md, 2022); tests compare both
functions with the library's.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Final

ANY, MANY, PART = "*", "**", "$*"
FORBIDDEN: Final = "#?"


def problem_of(key: str) -> str:
    """Return what is wrong with a key expression, "" if it is valid and canonical."""
    chunks = key.split("/")
    if "" in chunks:
        return "empty chunks are forbidden, as well as leading and trailing slashes"
    for chunk, following in zip(chunks, [*chunks[1:], ""], strict=True):
        if any(sign in chunk for sign in FORBIDDEN):
            return f"{chunk!r} holds one of {' '.join(FORBIDDEN)}"
        if chunk == PART:
            return "a chunk $* is written *"
        if PART * 2 in chunk:
            return f"{chunk!r} holds $*$*, which is written $*"
        if chunk not in (ANY, MANY) and any(sign in chunk.replace(PART, "") for sign in "*$"):
            return f"{chunk!r}: * is a whole chunk, ** too, or it follows a $"
        if chunk == MANY and following in (ANY, MANY):
            return f"{chunk}/{following} is written {'*/**' if following == ANY else '**'}"
    return ""


def includes(wide: str, narrow: str) -> bool:
    """Return whether every key of `narrow` is one of `wide`; both are valid."""
    return _includes(tuple(wide.split("/")), tuple(narrow.split("/")))


@cache
def _includes(wide: tuple[str, ...], narrow: tuple[str, ...]) -> bool:
    if not wide:
        return not narrow
    if wide[0] == MANY:
        return _includes(wide[1:], narrow) or bool(
            narrow and not narrow[0].startswith("@") and _includes(wide, narrow[1:]))
    return bool(narrow) and narrow[0] != MANY and _chunk(wide[0], narrow[0]) and _includes(wide[1:], narrow[1:])


def _chunk(wide: str, narrow: str) -> bool:
    if wide == narrow:
        return True
    if narrow.startswith("@") or wide.startswith("@") or narrow == ANY:
        return False
    return wide == ANY or _parts(_signs(wide), _signs(narrow))


def _signs(chunk: str) -> tuple[str, ...]:
    """Return the characters of a chunk, `$*` as one."""
    return tuple(sign for index, part in enumerate(chunk.split(PART)) for sign in ((PART,) if index else ()) + (*part,))


def _parts(wide: Sequence[str], narrow: Sequence[str]) -> bool:
    if not wide:
        return not narrow
    if wide[0] == PART:
        return _parts(wide[1:], narrow) or bool(narrow and _parts(wide, narrow[1:]))
    return bool(narrow) and narrow[0] == wide[0] and _parts(wide[1:], narrow[1:])
