"""Imports point one way, libraries stay behind their adapters, and a robot's process imports little."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BELOW = {                                       # what each package may import of the others
    "netem": set(),
    "fmus": set(),
    "firmware_sim": {"netem", "fmus"},
    "agents": {"firmware_sim", "netem", "fmus"},
    "experiments": {"agents", "firmware_sim", "netem", "fmus", "scenarios"},
}
ADAPTERS = {
    "zenoh": {"netem/transport/zenoh_session.py"},
    "fmpy": {"fmus/describe_fmu.py"},
    "can": {"firmware_sim/can_interface/bus.py", "firmware_sim/can_interface/other_interfaces.py",      # to programs
            "netem/media/can/can_log.py"},      # into log files
    "cantools": {"netem/media/can/dbc_file.py"},
    "pymavlink": {"firmware_sim/mavlink/dialect.py"},
}
HEAVY = ("pydantic", "pyarrow", "click", "rich", "jinja2", "fmpy", "scipy", "networkx", "mcap")
FILES = [str(path.relative_to(ROOT)) for package in BELOW for path in sorted((ROOT / package).rglob("*.py"))]


def imports(file: str) -> Iterator[tuple[int, str]]:
    """Line and top-level package of every import of a file, wherever it stands, also for types only."""
    for node in ast.walk(ast.parse((ROOT / file).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name.partition(".")[0]) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.lineno, (node.module or "").partition(".")[0] if node.level == 0 else file.partition("/")[0]


@pytest.mark.parametrize("package", BELOW)
def test_imports_point_one_way(package: str) -> None:
    wrong = {*BELOW, "scenarios", "tests", "benchmarks"} - {package} - BELOW[package]

    found = [f"{file}:{line} imports {name}" for file in FILES if file.startswith(f"{package}/")
             for line, name in imports(file) if name in wrong]

    assert found == []


@pytest.mark.parametrize("library", ADAPTERS)
def test_only_its_adapter_imports_a_library(library: str) -> None:
    importers = {file for file in FILES for _, name in imports(file) if name == library}

    assert importers == ADAPTERS[library]


def test_a_robots_process_imports_little() -> None:
    code = ("import sys, experiments.node_process, agents.synchronization.robot\n"
            f"print(*[name for name in {HEAVY} if name in sys.modules])")

    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)

    assert done.stdout.split() == []
