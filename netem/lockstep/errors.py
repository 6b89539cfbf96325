"""What can go wrong with a node. Each error names the node, its last report and what is being waited for."""

from __future__ import annotations

import re
import signal
from typing import Final

WHOLE_NANOSECONDS: Final = "times are int; wait with whole nanoseconds, timeout(1_000_000), not timeout(1e6)"


def with_remedy(error: str) -> str:
    """The text of a program's error; a compiled function that was handed a time of another type cannot say the rule."""
    handed_a_float = re.search(r"\bint object expected; got (float|numpy\.\w+)$", error)
    return f"{error}: {WHOLE_NANOSECONDS}" if handed_a_float else error


class Interrupted(KeyboardInterrupt):
    """The emulator's process was asked to end by the signal `number`, unlike a KeyboardInterrupt that a program raises.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def is_interruption(error: BaseException) -> bool:
    """Whether the process was asked to end; a KeyboardInterrupt that a program raises itself is a failure of it."""
    if isinstance(error, Interrupted):
        return True
    return isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) is signal.default_int_handler


class NodeFailure(Exception):
    """A node exited, hung, failed, broke its promise or spoke nonsense; the run is over, its folder is kept."""

    exit_code = 3

    def __init__(self, node: str, reason: str, *, last_report: str = "none", detail: str = "") -> None:
        self.node = node
        self.reason = reason
        self.last_report = last_report
        self.detail = detail
        self.counters: dict[str, int] = {}          # what the node had counted, where it could still say so
        super().__init__(f"node {node}: {reason} (last report: {last_report})" + (f"\n{detail}" if detail else ""))


class InstantLoop(Exception):
    """Nodes answered each other at one instant, over links without latency, more often than the bound allows."""

    exit_code = 3

    def __init__(self, time_ns: int, nodes: list[str], rounds: int) -> None:
        self.time_ns = time_ns
        self.nodes = nodes
        super().__init__(f"{time_ns} ns: {rounds} rounds of frames at this one instant among {', '.join(nodes)}: "
                         "their links have no latency and each answers at once; give a link latency, or let a program "
                         "wait first")
