"""Libraries that only confirm our numbers."""

from __future__ import annotations

from typing import Any

import pytest


def cvxpy() -> Any:
    """Convex programs, semidefinite ones too, by a solver that shares nothing with ours."""
    return pytest.importorskip("cvxpy", reason="needs cvxpy: pip install -e '.[oracles]'")


def rtamt() -> Any:
    """Robustness of signal temporal logic over samples, by a monitor that shares nothing with ours."""
    return pytest.importorskip("rtamt", reason="needs rtamt: pip install -e '.[oracles]'")
