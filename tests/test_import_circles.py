"""No module imports itself by way of others, wherever the imports stand: for types only or in a function as well."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.sources import import_statements

ROOT = Path(__file__).parents[1]
PACKAGES = ("netem", "fmus", "firmware_sim", "agents", "experiments", "marconet")
FILES = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
         for package in PACKAGES for path in (ROOT / package).rglob("*.py")}


def imported_by(path: Path) -> set[str]:
    """Modules of ours; a package counts where a name of its own `__init__` is imported."""
    found = set()
    for node in import_statements(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif node.module:
            parts = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {part if part in FILES else node.module for part in parts}
    return found & FILES.keys()


@pytest.mark.parametrize("package", PACKAGES)
def test_no_module_imports_itself_by_way_of_others(package: str) -> None:
    graph = {module: imported_by(path) for module, path in FILES.items() if module.split(".")[0] == package}

    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" is imported by ".join(error.args[1]))
