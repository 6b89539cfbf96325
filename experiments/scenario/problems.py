"""Collects the problems of a scenario: one line each, `file: key.path=value: rule; remedy`."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable
from typing import Any, Final

from netem.core.nearest import did_you_mean

Place = tuple[str | int, ...]           # ("impairments", 0, "loss_ratio")

_BARE_KEY: Final = re.compile(r"[A-Za-z0-9_-]+")
_LONGEST_VALUE: Final = 60              # characters shown of a value
_ABSENT: Final = object()


class ScenarioError(ValueError):
    """A scenario cannot be run as it is written; `problems` has one line for each mistake found."""

    exit_code = 2

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(self.problems))


class Problems:
    """Collects problems; only the first one at a place is reported, as later ones are its consequences."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.lines: list[str] = []
        self.found = 0                  # number of problems, also those that are not reported
        self._agents: dict[tuple[Place, str], list[str]] = {}       # agents with the same mistake, by place and text
        self._line_of: dict[tuple[Place, str], tuple[int, str]] = {}
        self.written_at: Callable[[Place], Place] = lambda place: place     # place of a value -> its place in the file
        self._places: set[Place] = set()

    def add(self, place: Place, rule: str, value: Any = _ABSENT) -> None:
        self.found += 1
        place = self.written_at(place)
        if place and place in self._places:
            return
        self._places.add(place)
        where = path_text(place) + ("" if value is _ABSENT else f"={value_text(value)}")
        line = f"{self.file}: {where}: {rule}" if where else f"{self.file}: {rule}"
        if len(place) > 2 and place[0] == "agents" and not self._is_first_of_its_kind(place, line):
            return
        self.lines.append(line)

    def _is_first_of_its_kind(self, place: Place, line: str) -> bool:
        """Return False if another agent has the same mistake at the same place; add this agent to its line then."""
        name = str(place[1])
        kind = place[2:], line.replace(path_text(place[:2]), "", 1)
        agents = self._agents.setdefault(kind, [])
        agents.append(name)
        if len(agents) == 1:
            self._line_of[kind] = len(self.lines), line
            return True
        at, alone = self._line_of[kind]
        self.lines[at] = f"{alone} ({len(agents)} agents: {', '.join(agents)})"
        return False

    def say(self, line: str) -> None:
        """Add a problem whose text names its place."""
        self.found += 1
        if f"{self.file}: {line}" not in self.lines:
            self.lines.append(f"{self.file}: {line}")

    def has(self, place: Place) -> bool:
        return self.written_at(place) in self._places

    def stop_if_any(self) -> None:
        if self.lines:
            raise ScenarioError(self.lines)


def path_text(place: Place) -> str:
    """Return a place as text: ("impairments", 0, "loss_ratio") -> impairments[0].loss_ratio."""
    text = ""
    for part in place:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            key = part if _BARE_KEY.fullmatch(part) else json.dumps(part, ensure_ascii=False)
            text += f".{key}" if text else key
    return text


def value_text(value: Any) -> str:
    """Return a value as TOML, shortened to 60 characters."""
    if isinstance(value, dict):
        inside = ", ".join(f"{path_text((key,))} = {value_text(item)}" for key, item in value.items())
        text = f"{{ {inside} }}" if inside else "{}"
    elif isinstance(value, list | tuple):
        text = "[" + ", ".join(value_text(item) for item in value) + "]"
    elif isinstance(value, str):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, bool):
        text = str(value).lower()
    else:
        text = str(value)
    return text if len(text) <= _LONGEST_VALUE else text[:_LONGEST_VALUE - 3] + "..."


def near(word: object, known: Iterable[str]) -> str:
    """Return the remedy for an unknown name: the nearest valid name, or all of them."""
    names = list(known)
    all_names = "there are none" if not names else \
        "there are " + ", ".join(names) if len(names) > 1 else f"there is only {names[0]}"
    return did_you_mean(word, names, all_names, quote=value_text, cutoff=0.5)
