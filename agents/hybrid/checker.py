"""Refuses a recorded execution that is not one of its automaton.

    start      the first mode and state are in Init; it starts again only after its node was dead
    order      t_i <= t_(i+1) (Definition 2), and each change begins in the mode in which the last one ended
    edge       the pair of modes is in E
    guard      state and inputs are in G(e)
    reset      the state after the change is R(e, ...), each variable to 1 part in 10^9
    domain     the states before and after a change, and all samples between, are in Dom(q)
    apart      changes along an edge are at least `apart_ns` apart
    rate       between samples in one mode each variable changes within its rates

Samples are judged by those parts of a domain whose variables are all recorded as signals of the same names. A sample at
the instant of a change is taken after it.
Not modelled: instants between samples; a robot's clock that runs fast, which shortens true gaps by its drift.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import isclose, isnan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from agents.hybrid.automaton import Automaton
from agents.hybrid.mode_change import START, ModeChange
from agents.hybrid.region import All, Point, Region

ROUNDING: Final = 1e-9      # relative; of numbers that program and plant compute in different ways


class Rule(Enum):
    START = "start"
    ORDER = "order"
    EDGE = "edge"
    GUARD = "guard"
    RESET = "reset"
    DOMAIN = "domain"
    APART = "apart"
    RATE = "rate"
    CONTROL = "control"         # of networks: see `network`
    UNREADABLE = "unreadable"   # an event `mode` that tells no change


@dataclass(frozen=True)
class Refusal:
    """A rule that does not hold, over [from_ns, until_ns): samples in a row; at a change until_ns = from_ns."""

    node: str
    rule: Rule
    from_ns: int
    until_ns: int
    what: str


@dataclass(frozen=True)
class Samples:
    """`values[k, column]` at `time_ns[k]`, in increasing order; columns as in `names`."""

    names: tuple[str, ...] = ()
    time_ns: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    values: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))


def check(node: str, automaton: Automaton, changes: Sequence[ModeChange], samples: Samples | None = None,
          dead_ns: Sequence[tuple[int, int]] = ()) -> list[Refusal]:
    """Return what makes the recorded execution of `node` none of its automaton, by instant; empty: it is one.

    `changes` are in the order in which they were recorded; `dead_ns` are the intervals [start, end) in which a fault
    had killed the node.
    """
    if not changes:
        return [Refusal(node, Rule.START, 0, 0, "its program declares an automaton and recorded no mode")]
    found = [*_changes(node, automaton, changes, dead_ns)]
    if samples is not None:
        found += _samples(node, automaton, changes, samples, dead_ns)
    return sorted(found, key=lambda refusal: refusal.from_ns)


def _changes(node: str, automaton: Automaton, changes: Sequence[ModeChange],
             dead_ns: Sequence[tuple[int, int]]) -> Iterator[Refusal]:
    last: ModeChange | None = None
    taken_ns: dict[tuple[str, str], int] = {}
    started_ns = 0
    for change in changes:
        arrow = f"{change.before} -> {change.after}"

        def refuse(rule: Rule, what: str, at_ns: int = change.time_ns) -> Refusal:
            return Refusal(node, rule, at_ns, at_ns, what)

        if last is not None and change.time_ns < last.time_ns:
            yield refuse(Rule.ORDER, f"{arrow} at {change.time_ns} ns was recorded after a change at {last.time_ns} ns")
        missing = sorted(automaton.variables.keys() - (change.state.keys() & change.reached.keys()))
        if missing:
            yield refuse(Rule.UNREADABLE, f"{arrow}: the state lacks {', '.join(missing)}")
        elif change.before == START:
            yield from (refuse(Rule.START, what) for what in _start(automaton, change, last, dead_ns))
            started_ns, taken_ns = change.time_ns, {}
        else:
            if last is None:
                yield refuse(Rule.START, f"{arrow} is the first change: expected the start of the execution")
            elif last.after != change.before:
                yield refuse(Rule.ORDER, f"{arrow}: the mode before was {last.after}")
            since_ns = change.time_ns - taken_ns.get((change.before, change.after), started_ns)
            yield from (refuse(rule, f"{arrow}: {what}") for rule, what in _edge(automaton, change, since_ns))
            taken_ns[change.before, change.after] = change.time_ns
        last = change


def _start(automaton: Automaton, change: ModeChange, last: ModeChange | None,
           dead_ns: Sequence[tuple[int, int]]) -> Iterator[str]:
    if last is not None and not any(last.time_ns <= from_ns < until_ns <= change.time_ns
                                    for from_ns, until_ns in dead_ns):
        yield "it starts again, although no fault had killed its node"
    if change.after not in automaton.initial:
        yield f"{change.after} is no initial mode; there are {', '.join(automaton.initial)}"
    elif not automaton.initial[change.after].holds(change.reached):
        yield f"{_shown(change.reached)} is not in Init of {change.after}: {automaton.initial[change.after]}"
    elif not automaton.modes[change.after].domain.holds(change.reached):
        yield f"{_shown(change.reached)} is not in Dom({change.after}): {automaton.modes[change.after].domain}"


def _edge(automaton: Automaton, change: ModeChange, since_ns: int) -> Iterator[tuple[Rule, str]]:
    edge = automaton.edge(change.before, change.after)
    if edge is None:
        others = ", ".join(each.target for each in automaton.edges if each.source == change.before) or "none"
        yield Rule.EDGE, f"the automaton has no such edge; edges from {change.before} lead to: {others}"
        return
    point = {**change.state, **change.inputs}
    needed = edge.guard.variables | {to for to in edge.reset.values() if isinstance(to, str)}
    if absent := sorted(needed - point.keys()):
        yield Rule.GUARD, f"the input {', '.join(absent)} was not recorded"
        return
    if not edge.guard.holds(point):
        yield Rule.GUARD, f"{_shown(point)} is not in the guard {edge.guard}"
    wanted = {name: change.state[name] for name in automaton.variables} | edge.reached(point)
    wrong = {name: value for name, value in wanted.items() if not _same(value, change.reached[name])}
    if wrong:
        there = _shown({name: change.reached[name] for name in wrong})
        yield Rule.RESET, f"the reset gives {_shown(wrong)}, the state after the change has {there}"
    for mode, state, when in ((change.before, change.state, "before"), (change.after, change.reached, "after")):
        if not automaton.modes[mode].domain.holds(state):
            yield Rule.DOMAIN, (f"the state {when} it, {_shown(state)}, is not in Dom({mode}): "
                                f"{automaton.modes[mode].domain}")
    if since_ns < edge.apart_ns:
        yield Rule.APART, f"{since_ns} ns after the last: expected at least {edge.apart_ns} ns"


def _samples(node: str, automaton: Automaton, changes: Sequence[ModeChange], samples: Samples,
             dead_ns: Sequence[tuple[int, int]]) -> Iterator[Refusal]:
    change_ns = np.array([change.time_ns for change in changes], dtype=np.int64)
    at_change = np.searchsorted(change_ns, samples.time_ns, side="right") - 1
    alive = at_change >= 0
    for from_ns, until_ns in dead_ns:
        alive &= ~((from_ns <= samples.time_ns) & (samples.time_ns < until_ns))
    regions = {name: All(*_recorded(mode.domain, samples.names)) for name, mode in automaton.modes.items()}
    column = {name: samples.names.index(name) for mode in automaton.modes.values() for name in
              {*regions_of(regions), *mode.rates} if name in samples.names}
    outside: dict[str, list[tuple[int, Point]]] = {}
    previous = -1
    for k in range(samples.time_ns.size):
        if not alive[k]:
            previous = -1
            continue
        mode_name = changes[int(at_change[k])].after
        time_ns, point = int(samples.time_ns[k]), {name: float(samples.values[k, at]) for name, at in column.items()}
        if mode_name in regions and not regions[mode_name].holds(point):
            outside.setdefault(mode_name, []).append((time_ns, point))
        else:
            yield from _stretches(node, automaton, outside, time_ns)
        if previous >= 0 and at_change[previous] == at_change[k] and mode_name in automaton.modes:
            yield from _rates(node, automaton, mode_name, samples, previous, k)
        previous = k
    yield from _stretches(node, automaton, outside, int(samples.time_ns[-1]) if samples.time_ns.size else 0)


def _stretches(node: str, automaton: Automaton, outside: dict[str, list[tuple[int, Point]]],
               until_ns: int) -> Iterator[Refusal]:
    """Yield one refusal for each mode with samples outside, which end at `until_ns`, and forget them."""
    for mode, found in outside.items():
        from_ns, point = found[0]
        yield Refusal(node, Rule.DOMAIN, from_ns, until_ns,
                      f"{_shown(point)} is not in Dom({mode}): {automaton.modes[mode].domain}")
    outside.clear()


def _rates(node: str, automaton: Automaton, mode: str, samples: Samples, first: int, second: int) -> Iterator[Refusal]:
    from_ns, until_ns = int(samples.time_ns[first]), int(samples.time_ns[second])
    elapsed_s = (until_ns - from_ns) * 1e-9
    for name, (least, most) in automaton.modes[mode].rates.items():
        if name not in samples.names or elapsed_s <= 0:
            continue
        column = samples.names.index(name)
        before, after = float(samples.values[first, column]), float(samples.values[second, column])
        slack = ROUNDING * (abs(before) + abs(after) + 1.0)
        if not least * elapsed_s - slack <= after - before <= most * elapsed_s + slack:
            rate = (after - before) / elapsed_s
            yield Refusal(node, Rule.RATE, from_ns, until_ns, f"{name} changes by {rate:.6g} per s in {mode}: expected "
                          f"{least:g} to {most:g}")


def _recorded(region: Region, names: Sequence[str]) -> Iterator[Region]:
    """Yield the parts of an intersection whose variables are all among `names`."""
    for part in region.regions if isinstance(region, All) else (region,):
        if isinstance(part, All):
            yield from _recorded(part, names)
        elif part.variables <= set(names):
            yield part


def regions_of(regions: Mapping[str, Region]) -> frozenset[str]:
    """Return the variables that any of the regions reads."""
    return frozenset(name for region in regions.values() for name in region.variables)


def _same(one: float, other: float) -> bool:
    return isclose(one, other, rel_tol=ROUNDING, abs_tol=ROUNDING) or (isnan(one) and isnan(other))


def _shown(point: Point) -> str:
    return ", ".join(f"{name}={value:.6g}" for name, value in point.items()) or "the state"
