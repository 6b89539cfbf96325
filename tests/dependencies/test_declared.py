"""What pyproject.toml declares and what marconet imports are the same packages."""

from __future__ import annotations

import ast
import sys
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.sources import import_statements

TOP = Path(__file__).parents[2]
OURS = {"marconet", "netem", "fmus", "firmware_sim", "agents", "experiments", "scenarios"}
PROJECT = tomllib.loads((TOP / "pyproject.toml").read_text())["project"]
READ_AS_DATA = {"plotly"}                           # the report takes its JavaScript
OF_AN_EXTRA = {"cma", "distributed", "elftools", "filterpy", "foxglove", "mypy", "mypyc", "polars", "pytest",
               "setuptools", "ziglang"}             # by an extra


def imported() -> set[str]:
    found: set[str] = set()
    for room in sorted(OURS):
        for path in (TOP / room).rglob("*.py"):
            for node in import_statements(path):
                if isinstance(node, ast.Import):
                    found |= {alias.name.partition(".")[0] for alias in node.names}
                elif not node.level:
                    found.add((node.module or "").partition(".")[0])
    return found - OURS - OF_AN_EXTRA - set(sys.stdlib_module_names)


def declared() -> set[str]:
    return {canonicalize_name(Requirement(line).name) for line in PROJECT["dependencies"]}


def modules_of(package: str) -> set[str]:
    """Return the top-level modules that the files of an installed package make."""
    tops = {file.parts[0] for file in distribution(package).files or ()}
    return {top.partition(".")[0] for top in tops if not top.endswith((".dist-info", ".data"))}


def test_each_import_is_of_a_declared_package_and_each_declared_package_is_imported() -> None:
    needed, modules = imported(), {package: modules_of(package) for package in declared() - READ_AS_DATA}

    assert needed - set().union(*modules.values()) == set()
    assert [package for package, made in modules.items() if not made & needed] == []


@pytest.mark.parametrize("line", PROJECT["dependencies"])
def test_each_dependency_has_a_lower_bound(line: str) -> None:
    assert [bound.operator for bound in Requirement(line).specifier] == [">="]
