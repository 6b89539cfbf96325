"""Frame copies that enter a link at regular intervals, for the tests of impairments."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from netem.core.transit import Transit

Frames = Callable[..., list[Transit]]


@pytest.fixture(scope="session")
def frames() -> Frames:
    def make(count: int, *, every_ns: int = 1_000_000, data: bytes = b"0123456789") -> list[Transit]:
        return [Transit(n, n * every_ns, n * every_ns, data) for n in range(count)]

    return make
