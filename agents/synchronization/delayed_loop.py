"""The sampled loop with a constant delay of any length on every link: the exact map of a round, fixed topology.

State z = (x, registers): for each agent j the values s_j0, s_j1, ... that it broadcast last, the newest first. At the
start of its slot the registers of a speaking agent shift and s_j0 = C_j x_j. Whoever uses a value of j with delay d
uses at time t the newest one broadcast at t - d or before, s_jn with n the number of j's broadcasts in (t - d, t]:

    x_i' = A_i x_i - B_i K_i sum_{j in N_i} (s_i,n(i,i,t) - s_j,n(j,i,t))                   (6.11), d = 0 outside

n is constant between the instants (slot start + d mod slot), so a round is a product of exact maps. The loop is
exponentially stable if and only if the spectral radius of that product is below 1.

Differs from the dissertation (Remark 7), which needs a scattering transformation for a delay above the time between
two transmissions.
Not modelled: losses, delays that vary, the rounds around a change of topology (`exact_loop`: delays below a slot).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent, block_diagonal
from agents.synchronization.exact_loop import spectral_radius
from agents.synchronization.graph import Edge, Floats, neighbours
from agents.synchronization.matrix_exponential import matrix_exponential
from agents.synchronization.partition import Parts, partition

MOST_VALUES: Final = 600        # components of z up to which the map is computed: about three seconds
SCANNED: Final = 32             # delays that `longest_stable_ns` tries before it bisects
SHORTENED: Final = 6            # slots that `stable_slot_ns` tries, each half as long as the one before


@dataclass(frozen=True)
class Delays:
    """Time from the start of a slot until the value broadcast in it is used [ns]."""

    link_ns: Mapping[Edge, int]         # (sender, receiver): by the receiver
    own_ns: Sequence[int]               # by the sender itself, one per agent

    def __post_init__(self) -> None:
        for user, delay_ns in [*self.link_ns.items(), *enumerate(self.own_ns)]:
            if delay_ns < 0:
                raise ValueError(f"delay of {user}: {delay_ns} ns: expected 0 or more")

    def at_most(self, most_ns: int) -> Delays:
        return Delays({link: min(delay_ns, most_ns) for link, delay_ns in self.link_ns.items()},
                      tuple(min(delay_ns, most_ns) for delay_ns in self.own_ns))

    @property
    def longest_link_ns(self) -> int:
        return max(self.link_ns.values(), default=0)

    @property
    def longest_ns(self) -> int:
        return max(self.longest_link_ns, *self.own_ns)


@dataclass(frozen=True, eq=False)
class DelayedLoop:
    """One topology with its slots and delays. `delays` names every link of the Laplacian."""

    agents: tuple[LinearAgent, ...]
    laplacian: Floats
    slot_ns: int
    delays: Delays

    @cached_property
    def parts(self) -> Parts:
        return partition(self.laplacian)

    @cached_property
    def depths(self) -> list[int]:
        """The number of registers of each agent: one more than its values that are ever on their way."""
        longest_ns = list(self.delays.own_ns)
        for (sender, _), delay_ns in self.delays.link_ns.items():
            longest_ns[sender] = max(longest_ns[sender], delay_ns)
        return [1 + -(-delay_ns // self._round_ns) for delay_ns in longest_ns]

    @cached_property
    def size(self) -> int:
        """The number of components of z."""
        return sum(agent.states for agent in self.agents) + self._width * sum(self.depths)

    def start(self, x0: Floats) -> Floats:
        """Return z before the first slot if every agent uses every y(0) until a later value is due."""
        y0 = (self._loop.C_cl @ x0).reshape(len(self.agents), self._width)
        return np.concatenate([x0, *(np.tile(y, depth) for y, depth in zip(y0, self.depths, strict=True))])

    def round_map(self) -> Floats:
        """Return the map of z from just before a round's first broadcast to just before the next round's."""
        states, M = len(self._loop.A_open), np.eye(self.size)
        instants_ns = sorted({0, *(delay_ns % self.slot_ns for delay_ns in self._all_delays())})
        pieces = list(zip(instants_ns, [*instants_ns[1:], self.slot_ns], strict=True))
        steps = {end_ns - begin_ns: self._step((end_ns - begin_ns) * 1e-9) for begin_ns, end_ns in pieces}
        for slot, part in enumerate(self.parts):
            for agent in part:
                self._broadcast(M, agent)
            for begin_ns, end_ns in pieces:
                Phi, Gamma = steps[end_ns - begin_ns]
                M[:states] = Phi @ M[:states] + Gamma @ (self._coupling(slot * self.slot_ns + begin_ns) @ M[states:])
        return M

    def spectral_radius(self) -> float | None:
        """Return the spectral radius of a round's map; None if z has more than MOST_VALUES components."""
        return spectral_radius(self.round_map()) if self.size <= MOST_VALUES else None

    @property
    def is_stable(self) -> bool:
        radius = self.spectral_radius()
        return radius is not None and radius < 1

    @cached_property
    def longest_stable_ns(self) -> int | None:
        """Return the longest delay [ns] before the loop loses its stability, if every delay is cut to at most that one.

        Scanned are 0, one slot, two slots, ... or SCANNED equal steps of whole slots; the first loss is refined by
        bisection. Nothing is known between two scanned delays. None: the loop is unstable without delays."""
        longest_ns, stable_ns = self.delays.longest_ns, 0
        step_ns = self.slot_ns * max(1, -(-longest_ns // (SCANNED * self.slot_ns)))
        if not self._cut(0).is_stable:
            return None
        while stable_ns < longest_ns and self._cut(stable_ns + step_ns).is_stable:
            stable_ns += step_ns
        if stable_ns >= longest_ns:
            return longest_ns
        unstable_ns = stable_ns + step_ns
        while unstable_ns - stable_ns > 1:
            middle_ns = (stable_ns + unstable_ns) // 2
            if self._cut(middle_ns).is_stable:
                stable_ns = middle_ns
            else:
                unstable_ns = middle_ns
        return stable_ns

    @property
    def tried_slots_ns(self) -> list[int]:
        """The slots that `stable_slot_ns` tries: from four times this one on, each half as long, while a map exists."""
        tried = [DelayedLoop(self.agents, self.laplacian, self.slot_ns * 4 >> halved, self.delays)
                 for halved in range(SHORTENED) if self.slot_ns * 4 >> halved]
        return [loop.slot_ns for loop in tried if loop.size <= MOST_VALUES]

    @cached_property
    def stable_slot_ns(self) -> int | None:
        """Return the longest of `tried_slots_ns` with which the loop is stable under its delays; None: with none."""
        return next((slot_ns for slot_ns in self.tried_slots_ns
                     if DelayedLoop(self.agents, self.laplacian, slot_ns, self.delays).is_stable), None)

    def _cut(self, most_ns: int) -> DelayedLoop:
        return DelayedLoop(self.agents, self.laplacian, self.slot_ns, self.delays.at_most(most_ns))

    @property
    def _width(self) -> int:
        return self.agents[0].outputs

    @property
    def _round_ns(self) -> int:
        return len(self.parts) * self.slot_ns

    @cached_property
    def _loop(self) -> ClosedLoop:
        return ClosedLoop(self.agents, self.laplacian)

    @cached_property
    def _part_of(self) -> dict[int, int]:
        return {agent: index for index, part in enumerate(self.parts) for agent in part}

    def _all_delays(self) -> list[int]:
        return [*self.delays.link_ns.values(), *self.delays.own_ns]

    def _register(self, agent: int, n: int) -> slice:
        """Return the place of s_jn among the registers."""
        first = (sum(self.depths[:agent]) + n) * self._width
        return slice(first, first + self._width)

    def _broadcast(self, M: Floats, agent: int) -> None:
        states, held = len(self._loop.A_open), M[len(self._loop.A_open):]
        for n in range(self.depths[agent] - 1, 0, -1):
            held[self._register(agent, n)] = held[self._register(agent, n - 1)]
        outputs = slice(agent * self._width, (agent + 1) * self._width)
        held[self._register(agent, 0)] = self._loop.C_cl[outputs] @ M[:states]

    def _coupling(self, t_ns: int) -> Floats:
        """Return the matrix from the registers to x' from t_ns on, the broadcast of that instant included."""
        uses = np.zeros((len(self.agents) * self._width, self.size - len(self._loop.A_open)))
        one = np.eye(self._width)
        for i, heard in enumerate(neighbours(self.laplacian)):
            rows = slice(i * self._width, (i + 1) * self._width)
            for j in heard:
                uses[rows, self._register(i, self._on_its_way(i, t_ns, self.delays.own_ns[i]))] += one
                uses[rows, self._register(j, self._on_its_way(j, t_ns, self.delays.link_ns[j, i]))] -= one
        coupling: Floats = self._gains @ uses
        return coupling

    @cached_property
    def _gains(self) -> Floats:
        """-diag(B_1 K_1, ..., B_N K_N)."""
        return -block_diagonal([agent.B @ agent.K for agent in self.agents])

    def _on_its_way(self, agent: int, t_ns: int, delay_ns: int) -> int:
        """Return the number of broadcasts of `agent` in (t_ns - delay_ns, t_ns]."""
        since_ns = t_ns - self._part_of[agent] * self.slot_ns
        return since_ns // self._round_ns - (since_ns - delay_ns) // self._round_ns

    def _step(self, h_s: float) -> tuple[Floats, Floats]:
        """Return exp(A h) and the integral of exp(A s) over [0, h] for the agents without coupling."""
        A = self._loop.A_open
        n = len(A)
        grown = matrix_exponential(np.block([[A, np.eye(n)], [np.zeros((n, 2 * n))]]) * h_s)
        return grown[:n, :n], grown[:n, n:]
