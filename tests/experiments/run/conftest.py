"""A fixture that runs robots with faults on both hosts."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path

import pytest

from tests.experiments.run.fault_bench import HOSTS, SCENARIO, Ran


@pytest.fixture
def both(tmp_path: Path) -> Callable[..., Ran]:
    """Return a function that runs a scenario on both hosts, which have to agree, and returns the inline run."""
    calls = count()

    def ran(faults: str, scenario: str = SCENARIO) -> Ran:
        call = next(calls)
        inline, process = (Ran(tmp_path / f"{host}{call or ''}", host, faults, scenario) for host in HOSTS)
        assert inline.hash == process.hash
        return inline
    return ran
