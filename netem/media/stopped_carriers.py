"""Carriers of a radio channel that faults stop: neither bits nor power of a frame reach a node behind the cut.

    first bit, at the sender, within a window of the link -> not received, not sensed and no interference at that node,
                                                             from the first bit of the frame to its last

The instant of the first bit decides for the whole frame, as it does where a graph switches: the carrier of a frame that
is on the air when a window begins lasts to the end of the frame, and one that began within the window does not appear
when the window ends.

Not modelled: a part of a frame, walls that weaken a carrier without stopping it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from netem.core.windows import Windows
from netem.topology.reach import Reach


class StoppedCarriers:
    """Who is reached, `reach_at(sender, t_ns)`, without the nodes behind a cut."""

    def __init__(self, reach_at: Callable[[str, int], Reach]) -> None:
        self._reach_at = reach_at
        self._windows: dict[str, dict[tuple[str, str], Windows]] = {}       # by sender, then (receiver, cause)
        self._reached: dict[str, tuple[Reach, dict[str, str], Reach]] = {}  # by sender: without cuts, cuts, with cuts

    def add(self, sender: str, receiver: str, cause: str, start_ns: int, end_ns: int) -> None:
        """Stop the carrier of frames from `sender` to `receiver` whose first bit is in [start_ns, end_ns)."""
        self._windows.setdefault(sender, {}).setdefault((receiver, cause), Windows()).add(start_ns, end_ns)

    def reach_at(self, sender: str, t_ns: int) -> Reach:
        found = self._reach_at(sender, t_ns)
        stopped: dict[str, str] = {}
        for (receiver, cause), windows in self._windows.get(sender, {}).items():
            if receiver in found.rx_dbm and receiver not in stopped and windows.hold(t_ns):
                stopped[receiver] = cause
        if not stopped:
            return found
        last = self._reached.get(sender)
        if last is not None and last[0] is found and last[1] == stopped:
            return last[2]
        reach = _without(found, stopped)
        self._reached[sender] = found, stopped, reach
        return reach


def _without(found: Reach, stopped: dict[str, str]) -> Reach:
    """Return the reach without the `stopped` nodes; those that could have decoded the frame are `cut` by the cause."""
    return replace(found, in_range=found.in_range.difference(stopped),
                   too_weak=found.too_weak.union(found.in_range.intersection(stopped)),
                   rx_dbm={node: power_dbm for node, power_dbm in found.rx_dbm.items() if node not in stopped},
                   cut={node: cause for node, cause in stopped.items() if node in found.in_range})
