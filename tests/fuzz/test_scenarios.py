"""A small part of the fuzzing of scenarios; `python tests/fuzz/scenarios.py 10000` runs more."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest


def fuzzer():
    spec = importlib.util.spec_from_file_location("fuzz_scenarios", Path(__file__).with_name("scenarios.py"))
    module = sys.modules["fuzz_scenarios"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")       # of programs and literals that a mutant changed
def test_a_mutated_scenario_is_accepted_or_refused_in_plain_lines():
    found = [(str(one.mutant.source), one.why) for one in fuzzer().broken(500, seed=7)]

    assert found == []
