"""The errors that end a run because of a node, and the signals that end the emulator."""

from __future__ import annotations

import re
import signal
from collections.abc import Mapping, Sequence
from typing import Final

from netem.wire.program_errors import own_lines, what_failed

TRACEBACK: Final = "Traceback (most recent call last):"
WHOLE_NANOSECONDS: Final = "times are int; wait with whole nanoseconds, timeout(1_000_000), not timeout(1e6)"


def with_remedy(error: str) -> str:
    """Return the text of a program's error, with the rule for times added if a compiled function received a float."""
    handed_a_float = re.search(r"\bint object expected; got (float|numpy\.\w+)$", error)
    return f"{error}: {WHOLE_NANOSECONDS}" if handed_a_float else error


class Interrupted(KeyboardInterrupt):
    """The emulator's process received the signal `number`, which asks it to end; no program raises this."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def is_interruption(error: BaseException) -> bool:
    """Return whether a signal asked the process to end; a KeyboardInterrupt raised by a program is its failure."""
    if isinstance(error, Interrupted):
        return True
    return isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) is signal.default_int_handler


class NodeFailure(Exception):
    """A node exited, hung, failed, broke its promise or sent invalid values. The run ends and its folder is kept.

    `others` are nodes that failed at the same time and in the same way as `node`. `detail` is a traceback or the tail
    of a log. The message quotes only those lines of a traceback that lie in the author's files; `in_full` has them all.
    """

    exit_code = 3

    def __init__(self, node: str, reason: str, *, last_report: str = "none", detail: str = "",
                 others: Sequence[str] = ()) -> None:
        self.node = node
        self.reason = reason
        self.last_report = last_report
        self.detail = detail
        self.counters: dict[str, dict[str, int]] = {}       # by node that failed, where its counters are known
        self.others = list(others)
        who = f"{1 + len(others)} agents: {', '.join([node, *others])}" if others else f"node {node}"
        report = f" (last report: {last_report})"
        self.in_full = f"{who}: {reason}{report}" + (f"\n{detail}" if detail else "")
        if detail.startswith(TRACEBACK):
            super().__init__("\n".join(filter(None, [f"{who}: {reason}", own_lines(detail)])))
        else:
            super().__init__(self.in_full)


def programs_failed(traces: Mapping[str, tuple[str, str]]) -> NodeFailure:
    """Return the failure of the first node in `traces`, naming the others that failed in the same way.

    `traces` maps each node to what happened ("could not start", "its program failed at 5 ns") and its traceback.
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
