"""What program classes declare of themselves, by a method `(settings, team)`, asked for each agent that runs them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

from experiments.scenario.problems import Problems

Declared = TypeVar("Declared")


def declared(method: str, kind: type[Declared], programs: Mapping[type, Mapping[str, Any]], team: Mapping[str, Any],
             problems: Problems) -> Iterator[tuple[str, Declared]]:
    """Yield each agent whose program has `method`, with the `kind` that the method returns.

    Adds a problem for each call that fails or returns something else. `programs` maps each class to the settings of
    its agents.
    """
    for cls, settings_of in programs.items():
        if (declare := getattr(cls, method, None)) is None:
            continue
        for name, settings in settings_of.items():
            try:
                found = declare(settings, team)
            except Exception as error:
                problems.say(f"agents.{name}: {cls.__name__}.{method} failed: {type(error).__name__}: {error}")
                continue
            if isinstance(found, kind):
                yield name, found
            else:
                article = "an" if kind.__name__[0] in "AEIOU" else "a"
                problems.say(f"agents.{name}: {cls.__name__}.{method} returned {type(found).__name__}: expected "
                             f"{article} {kind.__name__}")
