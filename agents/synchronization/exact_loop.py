"""The sampled loop without conservative bounds: exact maps of slots and rounds, and the limit of the slot length.

State z = (x, y^), y^ the values last broadcast. Within a slot y^ is held; at its start the part P_k broadcasts:

    flow   z' = [ A_open  B_cl ] z        jump   y^_i+ = C_i x_i  for i in P_k
                [ 0       0    ]

A round map M takes z from just before a round's first broadcast to just before the next round's (monodromy matrix); a
fixed topology synchronizes exactly when its spectral radius is below 1. With a transmission delay the value sampled at
the slot's start takes effect `delay_s` later, at the receivers and at the sender alike.

A link that is new after a switch has no value until its sender's next slot; until then its term of (6.11) is left out.
With `previous`, the Laplacian before the switch, a map is that of the first round; without it all links have values.

Differs from the dissertation, which gives only sufficient conditions, and no rule for new links.
Not modelled: losses, delays of a slot or more (`delayed_loop`), agents whose slots are shifted against each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.graph import Floats, edges, laplacian
from agents.synchronization.matrix_exponential import matrix_exponential
from agents.synchronization.partition import Parts


class Hearing(Enum):
    """The rule for the value of a new link until its sender's next slot."""

    EVERYONE = "every agent hears every broadcast and keeps it: the sender's last value"
    NEIGHBOURS = "only those of the topology in force: the term is left out until the first value"


def links_with_a_value(current: Floats, previous: Floats, spoken: Sequence[int]) -> Floats:
    """Return the Laplacian of the links with a value in the first round after a switch; `spoken` have broadcast."""
    old = set(edges(previous))
    return laplacian(len(current), (link for link in edges(current) if link in old or link[0] in spoken))


@dataclass(frozen=True, eq=False)
class ExactLoop:
    """One topology with its broadcasting order; the slot length is an argument of every map."""

    agents: tuple[LinearAgent, ...]
    laplacian: Floats
    parts: Parts

    @cached_property
    def closed_loop(self) -> ClosedLoop:
        return ClosedLoop(self.agents, self.laplacian)

    def flow(self, t_s: float, acting: Floats | None = None) -> Floats:
        """Return the map of z over t_s without broadcasts; `acting`: Laplacian of the links with values (None: all)."""
        loop = self.closed_loop if acting is None else ClosedLoop(self.agents, acting)
        held = loop.B_cl.shape[1]
        generator = np.block([[loop.A_open, loop.B_cl], [np.zeros((held, len(loop.A_open) + held))]])
        return matrix_exponential(generator * t_s)

    def slot_map(self, slot: int, tau_s: float, delay_s: float = 0.0, previous: Floats | None = None) -> Floats:
        """Return the map of z over slot 0, 1, ..., T - 1 of a round, its broadcast included.

        Raises ValueError unless 0 <= delay_s < tau_s."""
        if not 0 <= delay_s < tau_s:
            raise ValueError(f"delay_s={delay_s}: expected 0 <= delay < tau_s ({tau_s})")
        before = after = None
        if previous is not None:
            spoken = [agent for part in self.parts[:slot] for agent in part]
            before = links_with_a_value(self.laplacian, previous, spoken)
            after = links_with_a_value(self.laplacian, previous, [*spoken, *self.parts[slot]])
        C, states = self.closed_loop.C_cl, len(self.closed_loop.A_open)
        spoken_rows = states + self._output_rows(slot)
        taken = self.flow(delay_s, before) if delay_s else np.eye(states + len(C))
        taken[spoken_rows] = 0.0
        taken[spoken_rows, :states] = C[self._output_rows(slot)]
        return self.flow(tau_s - delay_s, after) @ taken

    def round_map(self, tau_s: float, delay_s: float = 0.0, previous: Floats | None = None) -> Floats:
        """Return the monodromy matrix M, the map of z over a whole round of T slots."""
        M = np.eye(sum(self.closed_loop.C_cl.shape))
        for slot in range(len(self.parts)):
            M = self.slot_map(slot, tau_s, delay_s, previous) @ M
        return M

    def spectral_radius(self, tau_s: float, delay_s: float = 0.0) -> float:
        """Return the spectral radius of M; below 1 if and only if the loop is exponentially stable."""
        return spectral_radius(self.round_map(tau_s, delay_s))

    def _output_rows(self, slot: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
        width = self.agents[0].outputs
        return np.array([agent * width + k for agent in self.parts[slot] for k in range(width)], dtype=np.intp)


def spectral_radius(M: Floats) -> float:
    return float(np.abs(np.linalg.eigvals(M)).max())


@dataclass(frozen=True)
class StabilityLimit:
    """The first loss of stability in a scan of the slot length, refined by bisection.

    The loop is stable at `stable_s` and every scanned slot length below, unstable at `unstable_s`. Nothing is known
    between two scanned points (the spectral radius need not be monotone) or beyond `unstable_s`.
    """

    stable_s: float
    unstable_s: float
    scan_step_s: float


def stability_limit(loop: ExactLoop, scan_step_s: float, scan_end_s: float, delay_s: float = 0.0,
                    accuracy_s: float = 1e-12) -> StabilityLimit | None:
    """Scan delay_s + step, delay_s + 2 step, ... up to scan_end_s; return None if all of these are stable.

    Raises ValueError if the first is unstable."""
    points = int((scan_end_s - delay_s) / scan_step_s)
    for k in range(1, points + 1):
        if loop.spectral_radius(delay_s + k * scan_step_s, delay_s) < 1:
            continue
        if k == 1:
            raise ValueError(f"unstable already at tau = {delay_s + scan_step_s:g} s with a delay of {delay_s:g} s: "
                             f"scan with smaller steps, or A_cl is not Hurwitz, or the delay is too long")
        stable, unstable = delay_s + (k - 1) * scan_step_s, delay_s + k * scan_step_s
        while unstable - stable > accuracy_s and stable < (middle := (stable + unstable) / 2) < unstable:
            if loop.spectral_radius(middle, delay_s) < 1:
                stable = middle
            else:
                unstable = middle
        return StabilityLimit(stable, unstable, scan_step_s)
    return None
