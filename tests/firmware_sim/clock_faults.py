"""Steps of a clock by faults, for benches that advance a node by themselves."""

from __future__ import annotations

from collections.abc import Sequence

from netem.wire.messages import NodeFault


class ClockSteps:
    """`steps` are (true_ns, delta_ns) in order."""

    def __init__(self, steps: Sequence[tuple[int, int]] = ()) -> None:
        self._ahead = [NodeFault(true_ns, "clock_step", {"by_ns": delta_ns}) for true_ns, delta_ns in steps]

    def before(self, end_ns: int) -> list[NodeFault]:
        """The faults of a grant up to `end_ns`; each is returned once."""
        due = [fault for fault in self._ahead if fault.time_ns < end_ns]
        del self._ahead[:len(due)]
        return due
