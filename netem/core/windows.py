"""Time windows that may overlap and grow in number: an instant is inside if any of them holds it."""

from __future__ import annotations

from bisect import bisect_right


class Windows:
    """Half-open windows [start, end) in ns, merged where they overlap or touch."""

    def __init__(self) -> None:
        self._edges_ns: list[int] = []      # start, end, start, end, ..., ascending

    def add(self, start_ns: int, end_ns: int) -> None:
        """Add a window; ValueError for one without length."""
        if not start_ns < end_ns:
            raise ValueError(f"window [{start_ns}, {end_ns}): expected start < end")
        pairs = sorted([*zip(self._edges_ns[::2], self._edges_ns[1::2], strict=True), (start_ns, end_ns)])
        merged: list[int] = []
        for start, end in pairs:
            if merged and start <= merged[-1]:
                merged[-1] = max(merged[-1], end)
            else:
                merged += [start, end]
        self._edges_ns = merged

    def hold_both(self, first_ns: int, last_ns: int) -> bool:
        """Return whether one and the same window, merged ones being one, holds both instants."""
        edges = bisect_right(self._edges_ns, first_ns)
        return bool(edges & 1) and edges == bisect_right(self._edges_ns, last_ns)

    def hold(self, time_ns: int) -> bool:
        return bool(bisect_right(self._edges_ns, time_ns) & 1)      # an odd number of edges lies behind
