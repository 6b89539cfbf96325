"""Model-based holds (section 4.7): between the frames of a robot the others run its model instead of holding its value.

A frame brings the sender's observed state xh_j at its slot's start. From there on each user of j's value runs

    m_j' = A_j m_j + B_j v_j,   v_j = -K_j (l_jj C_j m_j - s_j),   and uses y^_j = C_j m_j in (6.11)

v_j is what the robot j itself applies, as far as the user can know it:

    "sender"    s_j = the sum of the y^_k that j used at its slot's start; it is in the frame, and is held
    "team"      s_j = the sum of the C_k m_k: the user runs the models of all robots

The sender uses C_j m_j as well, not its newest estimate, so that all have one y^_j (repair 8 of the dissertation). All
robots renew their inputs at the same control instants, `steps` in each slot and one when its frames have come, and hold
them in between; the models are stepped as exactly as the plants. A frame that takes d from its slot's start is brought
forward by d: its state moves with the v_j in force at the slot's start. All robots know where the observers start, so
the models start there too.

Source: Montestruque and Antsaklis 2003 (one plant, all of whose inputs the model knows); the rest is ours.
Not modelled: delays that differ from airtime and receive latency; topologies that change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum

import numpy as np

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.graph import Floats, neighbours
from agents.synchronization.matrix_exponential import held_input_step


class Hold(Enum):
    VALUE = "value"         # the value last broadcast, held (4.9)
    SENDER = "sender"
    TEAM = "team"


def control_instants_ns(slot_ns: int, steps: int, delay_ns: int) -> list[int]:
    """Return the control instants of a slot, from its start [ns], ascending."""
    return sorted({delay_ns, *(step * slot_ns // steps for step in range(steps))})


class ModelHold:
    """The models that robot `number` runs. Times are local and do not decrease from call to call."""

    def __init__(self, number: int, agents: Sequence[LinearAgent], laplacian: Floats, biases: Sequence[Sequence[float]],
                 hold: Hold, starts: Sequence[Floats], delay_ns: int) -> None:
        """`biases`: d_j of (6.6); `starts`: where the observers start; `delay_ns`: d."""
        self._agents, self._delay_ns = agents, delay_ns
        self._biases = [np.array(bias) for bias in biases]
        self._heard = neighbours(laplacian)
        self._number, self._hold = number, hold
        self._used = {number, *self._heard[number]}        # whose frames count
        self._modelled = sorted(self._used) if hold is Hold.SENDER else list(range(len(agents)))
        self._states = {j: np.array(starts[j], dtype=float) for j in self._modelled}
        first = {j: agent.C @ starts[j] for j, agent in enumerate(agents)}
        self._sums = {j: self._sum(j, first) for j in self._modelled}
        self._inputs = {j: np.zeros(agents[j].inputs) for j in self._modelled}
        self._at_slot = dict(self._inputs)                  # v_j in force at the start of the slot
        self._at_ns: int | None = None
        self._steps: dict[int, list[tuple[Floats, Floats]]] = {}

    def outputs(self, now_ns: int) -> dict[int, tuple[float, ...]]:
        """Return y^_j of this robot and of those that it hears."""
        self._advance(now_ns)
        return {j: tuple((self._agents[j].C @ self._states[j]).tolist()) for j in self._used}

    def control(self, now_ns: int, slot_starts: bool) -> None:
        """Bring the models to a control instant, which may be the start of a slot, and renew all v_j."""
        self._advance(now_ns)
        self._renew()
        if slot_starts:
            self._at_slot = dict(self._inputs)

    def frame_values(self, now_ns: int, estimate: Floats, count: int) -> tuple[float, ...]:
        """Return what this robot's frame brings, `count` numbers: its state, zeros, and with "sender" its s_j."""
        self._advance(now_ns)
        sums: list[float] = []
        if self._hold is Hold.SENDER:
            sums = self._sum(self._number, {j: self._agents[j].C @ self._states[j] for j in self._modelled}).tolist()
        return *estimate.tolist(), *[0.0] * (count - len(estimate) - len(sums)), *sums

    def take(self, now_ns: int, sender: int, values: Sequence[float]) -> None:
        """Take a frame whose slot began `delay_ns` before now, if it is of this robot or one that it is to hear."""
        if sender not in self._used:
            return
        self._advance(now_ns)
        state, outputs = np.array(values[:self._agents[sender].states]), self._agents[sender].outputs
        Phi, Gamma = self._step(self._delay_ns)[sender]
        self._states[sender] = Phi @ state + Gamma @ self._at_slot[sender]
        if self._hold is Hold.SENDER:
            self._sums[sender] = np.array(values[-outputs:])
        self._renew()

    def _renew(self) -> None:
        values = {j: self._agents[j].C @ self._states[j] for j in self._modelled}
        for j in self._modelled:
            agent = self._agents[j]
            s = self._sums[j] if self._hold is Hold.SENDER else self._sum(j, values)
            self._inputs[j] = -agent.K @ (len(self._heard[j]) * (values[j] - self._biases[j]) - s)

    def _sum(self, j: int, values: Mapping[int, Floats]) -> Floats:
        """Return the sum of y^_k - d_k over the robots k that j hears."""
        total = np.zeros(self._agents[j].outputs)
        for k in self._heard[j]:
            total = total + values[k] - self._biases[k]
        return total

    def _advance(self, now_ns: int) -> None:
        if self._at_ns is not None and now_ns > self._at_ns:
            steps = self._step(now_ns - self._at_ns)
            for j in self._modelled:
                Phi, Gamma = steps[j]
                self._states[j] = Phi @ self._states[j] + Gamma @ self._inputs[j]
        self._at_ns = now_ns

    def _step(self, h_ns: int) -> list[tuple[Floats, Floats]]:
        if h_ns not in self._steps:
            if len(self._steps) >= 64:          # a clock that is trimmed gives ever new steps
                self._steps.clear()
            self._steps[h_ns] = [held_input_step(agent.A, agent.B, h_ns * 1e-9) for agent in self._agents]
        return self._steps[h_ns]
