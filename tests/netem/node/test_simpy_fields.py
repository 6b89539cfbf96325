"""SimPy's private fields: a node's environment knows those of one version, and nothing else touches them."""

from __future__ import annotations

import ast
from collections.abc import Generator
from pathlib import Path
from typing import Any

import simpy

from netem.node.environment import NodeEnvironment, call_in, run_before, timeout_in

ROOT = Path(__file__).parents[3]
KNOWN = "4.1"                                       # the minor version whose `step` and `schedule` the loop repeats
FIELDS = {"_now", "_queue", "_eid", "_ok", "_value", "_delay"}      # used in USER
OTHERS = {"_defused", "_active_proc"}               # private as well, used nowhere
USER = ROOT / "netem" / "node" / "environment.py"       # the one class of ours that inherits SimPy's


def test_simpy_is_of_the_version_whose_private_fields_are_known() -> None:
    environment = simpy.Environment()
    missing = {name for name in ("_now", "_queue", "_eid") if not hasattr(environment, name)}
    missing |= {name for name in ("_ok", "callbacks") if not hasattr(environment.timeout(1), name)}
    assert vars(timeout_in(NodeEnvironment(), 1)).keys() == vars(NodeEnvironment().timeout(1)).keys()

    assert not missing, f"SimPy {simpy.__version__} has no {', '.join(sorted(missing))}: {USER.name} needs another way"
    assert simpy.__version__.startswith(f"{KNOWN}."), \
        f"SimPy {simpy.__version__}: read its Environment.step and schedule, compare with {USER.name}, and set KNOWN"


def test_private_fields_of_simpy_are_touched_in_one_file() -> None:
    found = []
    for package in ("netem", "fmus", "firmware_sim", "agents", "experiments", "marconet", "tests", "benchmarks"):
        for path in sorted((ROOT / package).rglob("*.py")):
            text = path.read_text()
            if path != USER and "cases" not in path.parts and any(f".{field}" in text for field in FIELDS | OTHERS):
                file = str(path.relative_to(ROOT))
                found += [f"{file}:{node.lineno} {node.attr}" for node in ast.walk(ast.parse(text))
                          if isinstance(node, ast.Attribute) and node.attr in FIELDS | OTHERS
                          and not (isinstance(node.value, ast.Name) and node.value.id == "self")]

    assert found == []


def test_simpys_own_steps_and_the_loop_see_the_same_time() -> None:
    def run(by_simpy: bool) -> list[tuple[int, Any]]:
        env, seen = NodeEnvironment(), []

        def program(name: str, period_ns: int) -> Generator[Any, Any, None]:
            for _ in range(3):
                yield env.timeout(period_ns)
                seen.append((env.now_ns, name))
                call_in(env, 0, lambda _: seen.append((env.now, f"alarm of {name}")))

        env.process(program("a", 20))
        env.process(program("b", 30))
        if by_simpy:
            env.run()
        else:
            for limit_ns in range(1, 100, 7):
                run_before(limit_ns, env)
        return seen

    assert run(by_simpy=True) == run(by_simpy=False)
    assert len(run(by_simpy=True)) == 12
