"""What can go wrong with a node. Each error names the node, its last report and what is being waited for."""

from __future__ import annotations

import re
import signal
from collections.abc import Mapping, Sequence
from typing import Final

from netem.wire.program_errors import own_lines, what_failed

TRACEBACK: Final = "Traceback (most recent call last):"
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
    """A node exited, hung, failed, broke its promise or spoke nonsense; the run is over, its folder is kept.

    `others` failed at the same time and in the same way as `node`. `detail` is a traceback or the tail of a log; of a
    traceback the message has the lines of the program's author, `in_full` everything.
    """

    exit_code = 3

    def __init__(self, node: str, reason: str, *, last_report: str = "none", detail: str = "",
                 others: Sequence[str] = ()) -> None:
        self.node = node
        self.reason = reason
        self.last_report = last_report
        self.detail = detail
        self.counters: dict[str, dict[str, int]] = {}       # what nodes that failed had counted, where known
        self.others = list(others)
        who = f"{1 + len(others)} agents: {', '.join([node, *others])}" if others else f"node {node}"
        report = f" (last report: {last_report})"
        self.in_full = f"{who}: {reason}{report}" + (f"\n{detail}" if detail else "")
        if detail.startswith(TRACEBACK):
            super().__init__("\n".join(filter(None, [f"{who}: {reason}", own_lines(detail)])))
        else:
            super().__init__(self.in_full)


def programs_failed(traces: Mapping[str, tuple[str, str]]) -> NodeFailure:
    """The failure of the first node, and of those with it that failed in the same way.

    `traces`: by node, what it was doing ("could not start", "its program failed at 5 ns") and the traceback.
    """
    def without_names(node: str) -> str:
        doing, trace = traces[node]
        return re.sub(rf"\b{re.escape(node)}\b", "", f"{doing}: {what_failed(trace)}")

    first = next(iter(traces))
    doing, trace = traces[first]
    others = [node for node in traces if node != first and without_names(node) == without_names(first)]
    return NodeFailure(first, f"{doing}: {with_remedy(what_failed(trace))}", detail=trace, others=others)


class InstantLoop(Exception):
    """Nodes answered each other at one instant, over links without latency, more often than the bound allows."""

    exit_code = 3

    def __init__(self, time_ns: int, nodes: list[str], rounds: int) -> None:
        self.time_ns = time_ns
        self.nodes = nodes
        super().__init__(f"{time_ns} ns: {rounds} rounds of frames at this one instant among {', '.join(nodes)}: "
                         "their links have no latency and each answers at once; give a link latency, or let a program "
                         "wait first")
