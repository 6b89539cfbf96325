"""A hybrid automaton as data: dissertation, Definition 1, after Lygeros et al. 2003.

    H = (Q, X, f, Upsilon, U, Delta, D, Init, Dom, E, G, R)

    Q        `modes`                              Init     `initial`, by mode a subset of X
    X        `variables` [unit]                   Dom      `Mode.domain`
    E        `edges`, a subset of Q x Q           G        `Edge.guard`
    Upsilon, Delta  `inputs` [unit], discrete     R        `Edge.reset`
             inputs and disturbances at a change  f, U, D  `Mode.rates`, bounds on the derivatives (2.1)

Differs from the dissertation: f is given as bounds on dx/dt for each variable, as in a rectangular automaton (Henzinger
1996), since the records of a run hold neither u nor d. `Edge.apart_ns` is the least time from one change along an edge
to the next, T_min of (2.3): with it no execution has infinitely many changes in finite time (no Zeno behaviour).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from agents.hybrid.region import EVERYWHERE, Point, Region

Assigned = float | str | Callable[[Point], float]       # a constant, a variable or input, or a function of them
NAME: Final = re.compile(r"[A-Za-z][\w-]*")


@dataclass(frozen=True)
class Mode:
    """`rates` maps variables to the least and greatest derivative [unit/s] that they have in this mode."""

    domain: Region = EVERYWHERE
    rates: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Edge:
    """A change from the mode `source` to `target`, possible at the points of `guard`, which reads inputs as well.

    A variable that `reset` does not name keeps its value. Two changes along the edge are at least `apart_ns` apart,
    the first that long after the start of the execution.
    """

    source: str
    target: str
    guard: Region = EVERYWHERE
    reset: Mapping[str, Assigned] = field(default_factory=dict)
    apart_ns: int = 0

    def reached(self, point: Point) -> dict[str, float]:
        """Return R(e, x, v, delta): the variables that the reset names, at a point of state and inputs."""
        return {name: point[to] if isinstance(to, str) else to(point) if callable(to) else float(to)
                for name, to in self.reset.items()}


@dataclass(frozen=True)
class Automaton:
    """`initial` maps the modes in which an execution may start to the states in which it may. ValueError lists all
    contradictions: edges between unknown modes, two edges between the same modes, sets that read unknown variables.
    """

    modes: Mapping[str, Mode]
    edges: Sequence[Edge]
    initial: Mapping[str, Region]
    variables: Mapping[str, str] = field(default_factory=dict)      # name -> unit
    inputs: Mapping[str, str] = field(default_factory=dict)         # name -> unit

    def __post_init__(self) -> None:
        if problems := list(self._problems()):
            raise ValueError("; ".join(problems))

    def edge(self, source: str, target: str) -> Edge | None:
        """Return the edge between two modes, None if there is none."""
        return next((edge for edge in self.edges if (edge.source, edge.target) == (source, target)), None)

    def _problems(self) -> list[str]:
        found = [f"{name!r}: expected letters, digits, - and _, a letter first"
                 for name in [*self.modes, *self.variables, *self.inputs] if NAME.fullmatch(name) is None]
        found += [f"{name!r} is a variable and an input: expected one of both"
                  for name in self.variables if name in self.inputs]
        if not self.initial:
            found.append("initial: expected at least one mode in which an execution starts")
        named = [*self.initial, *(name for edge in self.edges for name in (edge.source, edge.target))]
        found += [f"{name!r} is no mode; there are {', '.join(self.modes)}"
                  for name in dict.fromkeys(named) if name not in self.modes]
        pairs = [(edge.source, edge.target) for edge in self.edges]
        found += [f"{source} -> {target}: two edges: expected one, with the union of their guards"
                  for source, target in dict.fromkeys(pairs) if pairs.count((source, target)) > 1]
        states = {f"initial of {name}": region.variables for name, region in self.initial.items()}
        states |= {f"domain of {name}": mode.domain.variables for name, mode in self.modes.items()}
        states |= {f"rates of {name}": frozenset(mode.rates) for name, mode in self.modes.items()}
        states |= {f"reset of {edge.source} -> {edge.target}": frozenset(edge.reset) for edge in self.edges}
        for place, read in states.items():
            found += [f"{place}: {name!r} is no variable" for name in sorted(read - self.variables.keys())]
        for edge in self.edges:
            copied = {to for to in edge.reset.values() if isinstance(to, str)}
            found += [f"{edge.source} -> {edge.target}: {name!r} is neither a variable nor an input"
                      for name in sorted((edge.guard.variables | copied) - {*self.variables, *self.inputs})]
            if edge.apart_ns < 0:
                found.append(f"{edge.source} -> {edge.target}: apart_ns={edge.apart_ns}: expected 0 or more")
        return found
