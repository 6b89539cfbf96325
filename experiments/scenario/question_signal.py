"""`question_signal`: the signal that the scenario's question is about, which the report shows first."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fnmatch import fnmatchcase

from experiments.scenario.model import DerivedSpec
from experiments.scenario.problems import Place, Problems, near

PLACE: Place = ("question_signal",)


def check_question_signal(pattern: str, nodes: Collection[str], derived: Mapping[str, DerivedSpec],
                          problems: Problems) -> None:
    """Report what is wrong with `pattern`, "node.signal", each a pattern. `nodes` are all names under which signals are
    recorded, derived ones among them. Which signals a program records shows only when it runs: the report says so if
    none matches."""
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
