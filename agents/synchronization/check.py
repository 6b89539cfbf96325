"""Reasons why a team cannot synchronize over one graph, found before a run: each with the rule and the number.

- Assumption 7: every one-way link lies on a cycle, and the graph is strongly connected; otherwise flooding does not
  bring every record to every node. Both are needed only if the graph is discovered (section 6.3.1).
- Assumption 6: A_cl is Hurwitz.
- A slot is at least as long as the airtime of its frames, and the sampled loop with it is stable (`delayed_loop`).
"""

from __future__ import annotations

from collections.abc import Sequence

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.delayed_loop import MOST_VALUES, DelayedLoop, Delays
from agents.synchronization.graph import (
    Floats,
    edges,
    laplacian_problems,
    one_way_links_without_cycle,
    unreachable_pairs,
)
from netem.wire.instants import in_ms


def problems(agents: Sequence[LinearAgent], laplacian: Floats, *, slot_ns: int = 0, airtime_ns: int = 0,
             delay_ns: int = 0, names: Sequence[str] | None = None, discovered: bool = True,
             sure: bool = True) -> list[str]:
    """Return one sentence for each problem; empty: none.

    `airtime_ns` is the time that all frames of one slot need, guard times included; `slot_ns` = 0: unknown. A broadcast
    value takes effect `delay_ns` after its slot's start. Without `sure`, an unstable sampled loop is no problem.
    """
    broken = laplacian_problems(laplacian)
    if broken:
        return broken
    called = [f"agent {i}" for i in range(len(laplacian))] if names is None else list(names)
    found = []
    if discovered:
        one_way = one_way_links_without_cycle(laplacian)
        found += [f"the one-way link {called[i]} -> {called[j]} lies on no cycle (Assumption 7): nothing leads from "
                  f"{called[j]} back to {called[i]}; add a link, or tell the robots the topology" for i, j in one_way]
        cut_off = [pair for pair in unreachable_pairs(laplacian) if pair[::-1] not in one_way]
        if cut_off:
            i, j = cut_off[0]
            found.append(f"no path leads from {called[i]} to {called[j]} ({len(cut_off)} such pairs): discovery needs "
                         f"a strongly connected graph (section 6.3.1)")
    try:
        loop = ClosedLoop(tuple(agents), laplacian)
    except ValueError as error:
        return [*found, str(error)]
    worst = loop.rightmost_eigenvalue
    if worst.real >= 0:
        found.append(f"A_cl is not Hurwitz (Assumption 6): it has the eigenvalue {_printed(worst)}; change the gains K "
                     f"or the links (Remark 13 says what suffices)")
    if 0 < slot_ns < airtime_ns:
        found.append(f"a slot of {in_ms(slot_ns)} is shorter than its frames, {in_ms(airtime_ns)}: gamma "
                     "gamma_e(tau) < 1 (6.20) allows no longer slot; use a faster radio, shorter frames or smaller "
                     "gains K")
    elif sure and worst.real < 0 and slot_ns > 0:
        delays = Delays(dict.fromkeys(edges(loop.laplacian), delay_ns), (delay_ns,) * len(loop.agents))
        exact = DelayedLoop(loop.agents, loop.laplacian, slot_ns, delays)
        radius = exact.spectral_radius()
        if radius is None or radius >= 1:
            found.append(f"slots of {in_ms(slot_ns)} and a delay of {in_ms(delay_ns)} make the sampled loop unstable: "
                         f"{judgement(radius)}; {stable_delay(exact)}")
    return found


def judgement(radius: float | None) -> str:
    if radius is None:
        return f"the exact map of a round has more than {MOST_VALUES} rows, for which it is not computed"
    return f"the exact map of a round has the spectral radius {radius:.7g}, expected below 1"


def stable_delay(loop: DelayedLoop) -> str:
    """Return the remedy for an unstable loop in words."""
    longest_ns = loop.longest_stable_ns
    if longest_ns is None:
        return "it is unstable without delays too; use shorter slots"
    words = f"it is stable up to {in_ms(longest_ns)}, {longest_ns / loop.slot_ns:.4g} slots"
    if (slot_ns := loop.stable_slot_ns) is not None:
        return f"{words}, and with this delay if slots last {in_ms(slot_ns)}"
    if not (tried_ns := loop.tried_slots_ns):
        return words
    return f"{words}; with this delay no slot length tried is stable, {in_ms(tried_ns[-1])} to {in_ms(tried_ns[0])}"


def _printed(value: complex) -> str:
    return f"{value.real:.6g}" if value.imag == 0 else f"{value.real:.6g} {value.imag:+.6g}j"
