"""A change of mode as a record: the event `mode` of a node, whose detail is one line that `read` turns back.

    sensing -> pursuing at x=1.5,y=2.0 then x=1.5,y=0.0 with delta=0.25 by r2: award of target 1

    at    the state before the change                 with   the inputs at the change, if the automaton has any
    then  the state after it, if another              by     the node whose frame or sight caused it, if one did

The start of an execution, also that of a node that boots again, has no mode before the arrow. Numbers are written so
that they read back exactly. The instants of the changes are those of a hybrid time set (Definition 2).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final

from agents.hybrid.region import Point

KIND: Final = "mode"            # of the event
START: Final = ""               # the mode before the first one
_LINE: Final = re.compile(r"(?P<before>[\w-]*) ?-> (?P<after>[\w-]+) at (?P<state>\S+)(?: then (?P<reached>\S+))?"
                          r"(?: with (?P<inputs>\S+))?(?: by (?P<by>[\w-]+))?: (?P<cause>.*)", re.DOTALL)
_NONE: Final = "-"


@dataclass(frozen=True)
class ModeChange:
    """`state` is that before the change, `reached` that after it."""

    time_ns: int
    node: str
    before: str
    after: str
    state: Point
    reached: Point
    inputs: Point = field(default_factory=dict)
    by: str = ""
    cause: str = ""

    def detail(self) -> str:
        """Return the detail of the event."""
        then = "" if dict(self.reached) == dict(self.state) else f" then {_written(self.reached)}"
        inputs = f" with {_written(self.inputs)}" if self.inputs else ""
        by = f" by {self.by}" if self.by else ""
        return f"{self.before} -> {self.after} at {_written(self.state)}{then}{inputs}{by}: {self.cause}".lstrip()


def read(time_ns: int, node: str, detail: str) -> ModeChange | None:
    """Return the change of mode that an event tells; None if its detail is no such line."""
    found = _LINE.fullmatch(detail)
    if found is None:
        return None
    try:
        state = _numbers(found["state"])
        reached = state if found["reached"] is None else _numbers(found["reached"])
        inputs = {} if found["inputs"] is None else _numbers(found["inputs"])
    except ValueError:
        return None
    return ModeChange(time_ns, node, found["before"], found["after"], state, reached, inputs, found["by"] or "",
                      found["cause"])


def _written(point: Point) -> str:
    return ",".join(f"{name}={value!r}" for name, value in point.items()) or _NONE


def _numbers(text: str) -> dict[str, float]:
    """Return the point that `_written` wrote; ValueError if the text is none."""
    if text == _NONE:
        return {}
    pairs = [part.partition("=") for part in text.split(",")]
    return {name: float(value) for name, _, value in pairs}
