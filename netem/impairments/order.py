"""Order between a copy and those that went before it."""

from __future__ import annotations

from msgspec.structs import replace

from netem.core.transit import Transit


def not_before(transit: Transit, earliest_ns: int) -> Transit:
    """The copy as it is, or one that arrives at `earliest_ns` where it would arrive earlier."""
    return transit if transit.arrival_ns >= earliest_ns else replace(transit, arrival_ns=earliest_ns)
