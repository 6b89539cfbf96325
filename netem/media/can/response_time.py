"""Worst-case response times of periodic CAN messages: Davis, Burns, Bril, Lukkien 2007.

    busy period   t  = B + sum over hp(m) and m of ceil((t + J_k) / T_k) C_k
    instances     Q  = ceil((t + J_m) / T_m)
    queueing      w(q) = B + q C_m + sum over hp(m) of ceil((w(q) + J_k + bit) / T_k) C_k
    response      R  = max over q = 0 .. Q-1 of  J_m + w(q) - q T_m + C_m

B is the longest frame of lower priority, which may just have begun. R lasts from the event that queues a message to the
end of its intermission. The result is exact for messages of any phase and a queue by priority in every node. The first
instance alone, as in earlier analyses, gives too small a bound: it can delay frames of higher priority, which then
delay the next instance.

Source: R. I. Davis, A. Burns, R. J. Bril, J. J. Lukkien, "Controller Area Network (CAN) schedulability analysis:
Refuted, revisited and revised", Real-Time Systems 35, 2007, pages 239-272.

Not modelled: FIFO queues, errors on the bus, messages that are not periodic (give their least distance as the period).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import lcm


@dataclass(frozen=True)
class PeriodicMessage:
    """One message; a sequence of them is in order of priority. `frame_ns` is its longest time on the bus.

    That time includes the intermission.
    """

    name: str
    frame_ns: int               # C
    period_ns: int              # T
    jitter_ns: int = 0          # J: longest time from the event to the queueing of the message

    def __post_init__(self) -> None:
        if self.frame_ns < 1 or self.period_ns < 1 or self.jitter_ns < 0:
            raise ValueError(f"{self.name}: frame_ns={self.frame_ns}, period_ns={self.period_ns}, "
                             f"jitter_ns={self.jitter_ns}: expected at least 1, 1 and 0")


def utilization(messages: Sequence[PeriodicMessage]) -> float:
    """U = sum of C / T: the share of time that the bus needs."""
    return sum(message.frame_ns / message.period_ns for message in messages)


def response_time_ns(messages: Sequence[PeriodicMessage], index: int, bit_ns: int) -> int | None:
    """Worst-case response time of `messages[index]`, None if it is unbounded.

    The highest priority comes first; `bit_ns` >= 1 is the duration of a nominal bit.
    """
    own, higher = messages[index], messages[:index]
    competing = messages[:index + 1]
    blocking_ns = _blocking_ns(messages, index)
    if _overloaded(competing, blocking_ns):
        return None
    busy_ns = _fixed_point(own.frame_ns, lambda t: blocking_ns + sum(_releases(k, t) * k.frame_ns for k in competing))
    worst_ns, wait_ns = 0, blocking_ns
    for q in range(_releases(own, busy_ns)):
        wait_ns = _fixed_point(wait_ns, lambda w, q=q: blocking_ns + q * own.frame_ns             # type: ignore[misc]
                               + sum(_releases(k, w + bit_ns) * k.frame_ns for k in higher))
        worst_ns = max(worst_ns, own.jitter_ns + wait_ns - q * own.period_ns + own.frame_ns)
        wait_ns += own.frame_ns
    return worst_ns


def _blocking_ns(messages: Sequence[PeriodicMessage], index: int) -> int:
    return max((message.frame_ns for message in messages[index + 1:]), default=0)


def _releases(message: PeriodicMessage, within_ns: int) -> int:
    return -(-(within_ns + message.jitter_ns) // message.period_ns)


def _overloaded(messages: Sequence[PeriodicMessage], blocking_ns: int) -> bool:
    """Return whether the busy period does not end: U > 1, or U = 1 and there is blocking or jitter."""
    cycle_ns = lcm(*(message.period_ns for message in messages))
    demand_ns = sum(message.frame_ns * (cycle_ns // message.period_ns) for message in messages)
    backlog = blocking_ns > 0 or any(message.jitter_ns for message in messages)
    return demand_ns > cycle_ns or (demand_ns == cycle_ns and backlog)


def _fixed_point(start_ns: int, demand_ns: Callable[[int], int]) -> int:
    time_ns = start_ns
    while (longer_ns := demand_ns(time_ns)) != time_ns:
        time_ns = longer_ns
    return time_ns
