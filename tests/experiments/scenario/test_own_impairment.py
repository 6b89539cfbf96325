"""Impairments by import path: found beside the scenario, checked as those of the house are, refused with a reason."""

from __future__ import annotations

import re
import sys

import pytest

from experiments.scenario import ScenarioError, load
from experiments.scenario.impairment_kind import impairment_class
from netem.impairments.table import IMPAIRMENTS

FADING = """
from __future__ import annotations
from dataclasses import dataclass
from random import Random
from typing import ClassVar
from netem.core.fate import Fate

@dataclass
class Fading:
    loses_as: ClassVar[Fate] = Fate.LOST
    depth: float
    period_ns: int
    rng: Random

    def __post_init__(self):
        if not 0 <= self.depth <= 1:
            raise ValueError(f"depth={self.depth}: expected 0 <= depth <= 1")

    def carry(self, transit):
        if self.rng.random() >= self.depth:
            yield transit
"""


@pytest.fixture(autouse=True)
def forget_the_modules():
    yield
    for name in [name for name in sys.modules if name.startswith("fading_of_the_tests")]:
        del sys.modules[name]


def with_impairment(valid, keys, kind="fading_of_the_tests:Fading"):
    first = re.search(r'kind = "gilbert_elliott".*?(?=\[\[)', valid, re.DOTALL)
    return valid.replace(first[0], f'kind = "{kind}"\n{keys}\n')


def problems(path):
    with pytest.raises(ScenarioError) as error:
        load(path)
    return [line.removeprefix("few.toml: impairments[0].") for line in error.value.problems]


def test_a_class_beside_the_scenario_gets_its_keys_with_times_in_nanoseconds(valid, write):
    path = write(with_impairment(valid, "depth = 0.5\nperiod_ms = 2.5"))
    (path.parent / "fading_of_the_tests.py").write_text(FADING)

    first = load(path).impairments[0]

    assert first.fields == {"depth": 0.5, "period_ns": 2_500_000}
    assert impairment_class(first.kind, path.parent).__name__ == "Fading"
    assert impairment_class("delay", path.parent) is IMPAIRMENTS["delay"]


@pytest.mark.parametrize(("keys", "line"), [
    ("depth = 0.5\nperiod_ms = 1\nwidth = 2", "width=2: unknown key; did you mean \"depth\"?"),
    ("depth = \"deep\"\nperiod_ms = 1", "depth=\"deep\": expected a number"),
    ("depth = 2.0\nperiod_ms = 1", "depth=2.0: expected 0 <= depth <= 1"),
    ("period_ms = 1", "depth: is missing"),
    ("depth = 0.5\nperiod_ms = 1\nrng = 3", "rng=3: unknown key; "),
])
def test_its_keys_are_checked_as_those_of_the_house(keys, line, valid, write):
    path = write(with_impairment(valid, keys))
    (path.parent / "fading_of_the_tests.py").write_text(FADING)

    (found,) = problems(path)

    assert found.startswith(line)


@pytest.mark.parametrize(("change", "reason"), [
    (("@dataclass", ""), "Fading is no dataclass"),
    (("def carry", "def carries"), "Fading has no method carry(transit)"),
    (("    loses_as: ClassVar[Fate] = Fate.LOST", ""), "Fading does not say how a copy ends that it drops"),
    (("period_ns: int", "period_ns: Nanoseconds"), "the types of Fading's fields are not known"),
    (("class Fading", "class Fade"), "Fading is not in fading_of_the_tests; did you mean \"Fade\"?"),
    (("from random", "from randomness"), "fading_of_the_tests needs the module 'randomness', which is not installed"),
    (("from netem.core.fate", "from netem.fate"), "fading_of_the_tests needs the module 'netem.fate', which is "
     "not there any more; it is now netem.core.fate"),
    (("class Fading", "clas Fading"), "importing it failed: SyntaxError"),
    (("if not 0 <= self.depth", "if not 0 <= self.deep"), "constructing it failed: AttributeError"),
])
def test_a_class_that_is_no_impairment_is_refused_with_a_reason(change, reason, valid, write):
    path = write(with_impairment(valid, "depth = 0.5\nperiod_ms = 1"))
    (path.parent / "fading_of_the_tests.py").write_text(FADING.replace(*change, 1))

    (found,) = problems(path)

    assert found.startswith(f'kind="fading_of_the_tests:Fading": {reason}')


@pytest.mark.parametrize(("kind", "reason"), [
    ("nowhere_to_be_found:Fading", "there is no module 'nowhere_to_be_found'"),
    (":Fading", "expected 'package.module:Class'"),
    ("a b:c", "expected 'package.module:Class'"),
])
def test_a_path_that_leads_nowhere_is_refused(kind, reason, valid, write):
    (found,) = problems(write(with_impairment(valid, "depth = 0.5", kind)))

    assert found.startswith(f'kind="{kind}": {reason}')
