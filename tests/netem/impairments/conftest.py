"""What the tests of impairments share: a stream of frame copies as a link hands them out."""

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
