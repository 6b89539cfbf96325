"""The time for which drifting clocks, without corrections, keep the frames of slots apart.

Clock i reads L_i(t) = o_i + (1 + d_i) t. The slow node S begins to send at local time s and its frame has airtime a;
the fast node F begins at local time s + m slot, m slots later. In true time they begin at

    t_S = (s - o_S) / (1 + d_S)            t_F = (s + m slot - o_F) / (1 + d_F)

The frames overlap if t_S + a > t_F. With s = o_S + (1 + d_S) t_S and lead = o_F - o_S this is

    t_S > t* = (m slot - lead - a (1 + d_F)) / (d_F - d_S)

exactly, without linearization: no frame of S that begins up to t* overlaps, the first one after t* does, and S sends
once per round. Neighbours in the round (m = 1) with a = slot - 2 guard and drifts of +-p that start aligned have
t* = 2 guard / 2 p = guard / p, up to a p / 2 p = a / 2, since the airtime is true time.

A clock with ticks is late by at most tick - 1 ns; in the worst case S is, so the lead grows by that. Rounding instants
up to whole nanoseconds changes nothing (a and t are whole, and rounding up keeps the order).

Not modelled: propagation delay, drift that changes, more than one change of direction.
"""

from __future__ import annotations

from firmware_sim.local_clock import UNIT, rate_parts
from netem.wire.instants import NEVER_NS


def collision_free_until(drift_a_ppm: float, drift_b_ppm: float, slot_ns: int, airtime_ns: int, *, lead_ns: int = 0,
                         slots_apart: int = 1, tick_ns: int = 1) -> int:
    """Return t* in true ns: no frame that begins up to t* overlaps the other node's; 0 if frames overlap at once.

    `lead_ns`: reading of b's clock minus a's at true time 0. `slots_apart`: number of slots from the slower clock's
    slot to the faster one's (1: its neighbour in the round, the worst case). Returns `NEVER_NS` if the clocks do not
    drift apart; raises ValueError for numbers out of range.
    """
    if slots_apart < 1:
        raise ValueError(f"slots_apart={slots_apart}: expected at least 1")
    if airtime_ns < 0:
        raise ValueError(f"airtime_ns={airtime_ns}: expected 0 or more")
    slow, fast = rate_parts(drift_a_ppm), rate_parts(drift_b_ppm)
    if slow > fast:
        slow, fast, lead_ns = fast, slow, -lead_ns
    room = (slots_apart * slot_ns - lead_ns - (tick_ns - 1)) * UNIT - airtime_ns * (UNIT + fast)
    if room < 0:
        return 0
    if slow == fast:
        return NEVER_NS
    return room // (fast - slow)


def largest_drift_ppm(round_ns: int, slack_ns: int, gain: float, bound_ns: int) -> float:
    """Return the largest difference of drift [ppm] for which resynchronization keeps two nodes' frames apart.

    The two nodes hear each other. Between two corrections their clocks diverge by D = difference * round. Both step by
    gain * error, at most by `bound_ns`, so a steady error e satisfies 2 gain e = D, with D <= 2 bound, or the error
    grows without limit. The error is measured up to a round before the correction, so its peak is at most e + D. The
    peak must stay within `slack_ns`, the time between two frames (slot - airtime):

        D (1 + 1 / (2 gain)) <= slack     and     D <= 2 bound

    Valid for steps only; with a rate trim the steady error is zero, and the transient decides.
    """
    largest_parting_ns = min(slack_ns / (1 + 1 / (2 * gain)), 2 * bound_ns)
    return largest_parting_ns / round_ns * 1e6
