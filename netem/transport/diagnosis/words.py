"""Messages about the end of a process, the same for the process of a node and for that of an inline run.

    its process was ended by SIGSEGV in fmi3DoStep of plant cart, called at /home/me/carts.py:19 in measure
    no answer in window 21 within node_timeout_s = 30 s: it hangs at /home/me/robots.py:72 in act
"""

from __future__ import annotations

import signal
from collections.abc import Sequence
from typing import Final

from netem.transport.diagnosis.stack import Frame, as_traceback, frames_to_show, place_of
from netem.transport.diagnosis.under_way import UnderWay

_HINTS: Final[dict[int, str]] = {signal.SIGKILL: ": the system ends a process so when memory runs out"}


def signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def ended(exit_code: int, under_way: UnderWay | None = None) -> str:
    """Tell how a process ended; `exit_code` is -N for signal N."""
    where = location(under_way) if under_way is not None else ""
    if exit_code < 0:
        return f"was ended by {signal_name(-exit_code)}{where}{_HINTS.get(-exit_code, '')}"
    return f"exited with code {exit_code}{where if under_way is not None and under_way.call() else ''}"


def hangs(what: str, timeout_s: float, under_way: UnderWay, *, stopped: bool = False, starting: bool = False,
          frames: Sequence[Frame] | None = None) -> str:
    """Tell that `what` did not arrive within the time-out.

    `stopped` if the process is stopped, as by SIGSTOP; `starting` if the node was never ready, as it may only be slow.
    """
    where = location(under_way, frames)
    if stopped:
        state = f": it is stopped (SIGSTOP){where}"
    elif starting:
        state = f": it is still starting{where}; raise node_timeout_s if it only needs longer, as on a busy machine"
    else:
        state = f": it hangs{where}" if where else ""
    return f"{what} within node_timeout_s = {timeout_s:g} s{state}"


def location(under_way: UnderWay, frames: Sequence[Frame] | None = None) -> str:
    """Name the FMI call that runs and the user's line that led to it.

    `frames` is the stack of the code, by default the one that the fault handler has written.
    """
    call, place = under_way.call(), place_of(frames_to_show(under_way.stacks()) if frames is None else frames)
    if call:
        return f" in {call}" + (f", called at {place}" if place is not None else "")
    return f" at {place}" if place is not None else ""


def stack(under_way: UnderWay) -> str:
    """The stack of the user's thread as text, "" if the fault handler has written none."""
    return as_traceback(frames_to_show(under_way.stacks()))
