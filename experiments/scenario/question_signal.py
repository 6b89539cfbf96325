"""Checks `question_signal`, the signal of the scenario's question, which the report shows first."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fnmatch import fnmatchcase

from experiments.scenario.model import DerivedSpec
from experiments.scenario.problems import Place, Problems, near

PLACE: Place = ("question_signal",)


def check_question_signal(pattern: str, nodes: Collection[str], derived: Mapping[str, DerivedSpec],
                          problems: Problems) -> None:
    """Add the problems of `pattern`, "node.signal", each a shell pattern.

    `nodes` are all names under which signals are recorded, derived ones included. Signals of programs are not checked,
    as programs declare them when they start; the report has a note if none matches.
    """
    if not pattern:
        return
    node, dot, signal = pattern.partition(".")
    if not (node and dot and signal):
        problems.add(PLACE, "expected \"node.signal\", for example \"*.y\"", pattern)
        return
    matched = [name for name in nodes if fnmatchcase(name, node)]
    if not matched:
        problems.add(PLACE, f"no agent, derived signal or medium matches {node!r}; {near(node, nodes)}", pattern)
    elif all(name in derived for name in matched):
        known = [known for name in matched for known in derived[name].signals]
        if not any(fnmatchcase(name, signal) for name in known):
            problems.add(PLACE, f"derived.{matched[0]} has no signal {signal!r}; {near(signal, known)}", pattern)
