"""The node of a blocking program: its last report waits until the program has cleaned up."""

from __future__ import annotations

from typing import TYPE_CHECKING

from netem.node.node import Node
from netem.wire.messages import Grant, Report

if TYPE_CHECKING:
    from firmware_sim.blocking.program import BlockingProgram


class BlockingNode(Node):
    program: BlockingProgram | None = None

    def advance(self, grant: Grant) -> Report:
        report = super().advance(grant)
        if grant.last and self.program is not None:
            self.env.move_to(max(grant.horizon_ns, self.now_ns))     # later, if another node ended the run
            self.program.finish()
        return report
