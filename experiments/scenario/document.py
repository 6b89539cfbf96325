"""Reads a scenario file as TOML, with the question in its first comment; refuses values that JSON cannot carry."""

from __future__ import annotations

import re
import tomllib
from math import isfinite
from pathlib import Path
from typing import Any, Final

from experiments.scenario.problems import Place, Problems, ScenarioError

DEEPEST: Final = 40             # largest depth of nested tables and lists
_TOML_PLACE: Final = re.compile(r"(?P<rule>.*) \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)",
                                re.DOTALL)


def read(path: Path) -> tuple[dict[str, Any], str]:
    """Return the file's tables and its question; ScenarioError if it cannot be read or is not TOML."""
    try:
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise ScenarioError([f"{path}: cannot be read: {error.strerror or error}"]) from error
    except UnicodeDecodeError as error:
        raise ScenarioError([f"{path.name}: byte {error.start} is not UTF-8, the encoding of TOML"]) from error
    try:
        return tomllib.loads(text), question_of(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError([f"{path.name}: {_toml_problem(str(error), text)}"]) from error
    except RecursionError as error:
        raise ScenarioError([f"{path.name}: nested too deeply; at most {DEEPEST} tables and lists"]) from error


def question_of(text: str) -> str:
    """Return the text after `Question:` in the comment that opens the file, up to an empty line; "" if none."""
    words: list[str] = []
    for line in text.splitlines():
        if not line.lstrip().startswith("#"):
            if line.strip():
                break
            if words:
                break
            continue
        comment = line.lstrip().lstrip("#").strip()
        start = re.match(r"question:\s*", comment, re.IGNORECASE)
        if start:
            words = [comment[start.end():]]
        elif words:
            if not comment:
                break
            words.append(comment)
    return " ".join(word for word in words if word)


def check_values(document: dict[str, Any], problems: Problems) -> None:
    """Report values that no section may have: dates, not-a-number, infinity, integers beyond 64 bits."""
    waiting: list[tuple[Place, Any]] = [((), document)]
    while waiting:
        place, value = waiting.pop()
        if len(place) > DEEPEST:
            raise ScenarioError([*problems.lines, f"{problems.file}: {place[0]}: nested too deeply; "
                                                  f"at most {DEEPEST} tables and lists"])
        if isinstance(value, dict):
            waiting.extend(((*place, key), part) for key, part in reversed(value.items()))
        elif isinstance(value, list):
            waiting.extend(((*place, index), part) for index, part in reversed(list(enumerate(value))))
        elif isinstance(value, float) and not isfinite(value):
            problems.add(place, "expected a finite number", value)
        elif isinstance(value, int) and not -2**63 <= value < 2**64:
            problems.add(place, "expected a number that fits 64 bits", value)
        elif not isinstance(value, str | int | float | bool):
            problems.add(place, "dates and times of day mean nothing to a scenario; put text in quotes", value)


def _toml_problem(message: str, text: str) -> str:
    found = _TOML_PLACE.fullmatch(message)
    if found is None:
        return f"not TOML: {message}"
    line = found["line"] or str(text.count("\n") + 1)
    column = f", column {found['column']}" if found["column"] else ""
    rule = found["rule"]
    return f"line {line}{column}: not TOML: {rule[:1].lower()}{rule[1:]}"
