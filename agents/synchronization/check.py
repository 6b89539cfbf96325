"""What makes a team impossible to synchronize over one graph: said before a run, with the rule and the number.

- Assumption 7: every one-way link lies on a cycle; and the graph is strongly connected, or flooding cannot bring every
  record to every node. Both are needed only where the graph is discovered (section 6.3.1).
- Assumption 6: A_cl is Hurwitz.
- A slot is at least as long as the frames in it are on the air, and with it the sampled loop is stable (`exact_loop`).
"""

from __future__ import annotations

from collections.abc import Sequence

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.exact_loop import ExactLoop
from agents.synchronization.graph import Floats, laplacian_problems, one_way_links_without_cycle, unreachable_pairs
from agents.synchronization.partition import partition


def problems(agents: Sequence[LinearAgent], laplacian: Floats, *, slot_ns: int = 0, airtime_ns: int = 0,
             delay_ns: int = 0, names: Sequence[str] | None = None, discovered: bool = True,
             sure: bool = True) -> list[str]:
    """Everything that is wrong, one sentence each; empty if nothing is.

    `airtime_ns` is what the frames of one slot need in all, guard times included; slot_ns = 0 means not known.
    `delay_ns` is how long after its slot's start a broadcast value takes effect. Unless `sure`, a sampled loop that is
    unstable is no problem.
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
        found.append(f"a slot of {slot_ns} ns is shorter than its frames, {airtime_ns} ns: gamma gamma_e(tau) < 1 "
                     f"(6.20) allows no longer slot; use a faster radio, shorter frames or smaller gains K")
    elif sure and worst.real < 0 and 0 <= delay_ns < slot_ns:
        exact = ExactLoop(loop.agents, loop.laplacian, partition(loop.laplacian))
        radius = exact.spectral_radius(slot_ns * 1e-9, delay_ns * 1e-9)
        if radius >= 1:
            found.append(f"slots of {slot_ns} ns and a delay of {delay_ns} ns make the sampled loop unstable: its "
                         f"exact round map has the spectral radius {radius:.6g}, expected below 1; use shorter slots")
    return found


def _printed(value: complex) -> str:
    return f"{value.real:.6g}" if value.imag == 0 else f"{value.real:.6g} {value.imag:+.6g}j"
