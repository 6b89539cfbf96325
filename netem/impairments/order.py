"""Keeps a copy from overtaking earlier ones."""

from __future__ import annotations

from msgspec.structs import replace

from netem.core.transit import Transit


def not_before(transit: Transit, earliest_ns: int) -> Transit:
    """Return the copy, delayed to `earliest_ns` if it would arrive before."""
    return transit if transit.arrival_ns >= earliest_ns else replace(transit, arrival_ns=earliest_ns)
