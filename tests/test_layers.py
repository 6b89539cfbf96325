"""Imports point one way, libraries stay behind their adapters, and a robot's process imports little."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.sources import import_statements

ROOT = Path(__file__).parents[1]
BELOW = {                                       # what each package may import of the others
    "netem": set(),
    "fmus": set(),
    "firmware_sim": {"netem", "fmus"},
    "agents": {"firmware_sim", "netem", "fmus"},
    "experiments": {"agents", "firmware_sim", "netem", "fmus", "scenarios"},
    "marconet": {"experiments", "agents", "firmware_sim", "netem", "fmus", "scenarios"},
}
# Rooms of a package, floor by floor, the lowest first: a room imports itself and what lies below it.
FLOORS = {
    "netem": (("wire",), ("core",), ("impairments", "faults", "gateways", "records", "topology", "node"),
               ("media", "transport"), ("emulator",)),
    "experiments": (("compiled",), ("programs",), ("scenario",), ("judge",), ("show",), ("run",), ("sweep",),
                    ("search",)),
}
ADAPTERS = {
    "zenoh": {"netem/transport/zenoh_session.py", "firmware_sim/zenoh_programs/real.py",
              "netem/gateways/zenoh_endpoint.py"},      # to programs outside of the run
    "fmpy": {"fmus/describe_fmu.py"},
    "can": {"firmware_sim/can_interface/bus.py", "firmware_sim/can_interface/other_interfaces.py",      # to programs
            "netem/media/can/can_log.py", "netem/media/can/can_log_reader.py",      # into log files, and from them
            "netem/media/can/outside_bus.py"},  # to buses outside of the run
    "cantools": {"netem/media/can/dbc_file.py"},
    "pymavlink": {"firmware_sim/mavlink/dialect.py", "firmware_sim/mavlink/c_headers.py"},
    "cryptography": {"netem/gateways/certificate_authority.py", "netem/gateways/certificate_table.py"},
    "foxglove": {"experiments/show/view/foxglove_server.py"},
    "websockets": {"experiments/show/view/server.py"},
    "pydantic": {"experiments/scenario/foreign_types.py"},
}
HEAVY = ("pydantic", "pyarrow", "click", "rich", "jinja2", "fmpy", "scipy", "networkx", "mcap", "experiments.scenario",
         "netem.emulator", "netem.faults", "netem.impairments.table", "netem.records", "netem.topology")
FILES = [str(path.relative_to(ROOT)) for package in BELOW for path in sorted((ROOT / package).rglob("*.py"))]


def imports(file: str, *, whole: bool = False) -> Iterator[tuple[int, str]]:
    """Line and top-level package (`whole`: module) of every import of a file, wherever it stands."""
    for node in import_statements(ROOT / file):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name if whole else alias.name.partition(".")[0]) for alias in node.names)
        else:
            module = node.module or ""
            if whole and module.count(".") == 0:        # from netem import core
                yield from ((node.lineno, f"{module}.{alias.name}") for alias in node.names)
            else:
                yield node.lineno, module if whole else module.partition(".")[0] if node.level == 0 \
                    else file.partition("/")[0]


@pytest.mark.parametrize("package", BELOW)
def test_imports_point_one_way(package: str) -> None:
    wrong = {*BELOW, "scenarios", "tests", "benchmarks"} - {package} - BELOW[package]

    found = [f"{file}:{line} imports {name}" for file in FILES if file.startswith(f"{package}/")
             for line, name in imports(file) if name in wrong]

    assert found == []


@pytest.mark.parametrize("package", FLOORS)
def test_no_room_imports_one_beside_or_above_it(package: str) -> None:
    floor = {room: level for level, rooms in enumerate(FLOORS[package]) for room in rooms}
    rooms = {path.name for path in (ROOT / package).iterdir() if (path / "__init__.py").exists()}

    found = [f"{file}:{line} imports {name}" for file in FILES if file.startswith(f"{package}/") and file.count("/") > 1
             for line, name in imports(file, whole=True) if name.split(".")[0] == package
             if (here := file.split("/")[1]) != (there := name.split(".")[1]) and floor.get(there, -1) >= floor[here]]

    assert rooms == floor.keys()
    assert found == []


@pytest.mark.parametrize("library", ADAPTERS)
def test_only_its_adapter_imports_a_library(library: str) -> None:
    importers = {file for file in FILES for _, name in imports(file) if name == library}

    assert importers == ADAPTERS[library]


@pytest.mark.parametrize("program", ["agents.synchronization.robot", "agents.tracking.tracking_robot",
                                     "agents.waves.robot"])
def test_a_robots_process_imports_little(program: str) -> None:
    code = (f"import sys, experiments.run.node_process, {program}\n"
            f"print(*[name for name in {HEAVY} if name in sys.modules])")

    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)

    assert done.stdout.split() == []
