"""The sampled loop with model-based holds (`model_hold`): the exact map of a round, and the limit of the slot length.

State z = (x, xh, models, s): states and estimates of all agents, the models of their users (one set for "sender", as
all users have the same; a set of each robot for "team"), and the sums s_j of the frames ("sender"). All inputs are
linear in z, renewed at control instants and held between them, so a round is a product of exact maps.

As in `observed_loop` the spectrum contains that of the observers; with eps = 0 the rest is the loop of robots that know
their states.

Not modelled: losses, delays of the first control step of a slot or more, disturbances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from agents.synchronization.closed_loop import LinearAgent, block_diagonal
from agents.synchronization.exact_loop import spectral_radius
from agents.synchronization.graph import Floats, neighbours
from agents.synchronization.matrix_exponential import held_input_step
from agents.synchronization.model_hold import Hold, control_instants_ns
from agents.synchronization.observer import observer_gain
from agents.synchronization.partition import Parts


@dataclass(frozen=True, eq=False)
class ModelLoop:
    """One topology; `poles` are those of each agent's observer [1/s]; `hold` is "sender" or "team"."""

    agents: tuple[LinearAgent, ...]
    laplacian: Floats
    parts: Parts
    poles: Sequence[Sequence[float]]
    hold: Hold
    steps: int

    def start(self, x0: Floats, xh0: Floats) -> Floats:
        """Return z before the first slot; all models start where the observers do."""
        sets = 1 if self.hold is Hold.SENDER else len(self.agents)
        z: Floats = np.concatenate([x0, np.tile(xh0, 1 + sets), self._others @ self._C @ xh0])
        return z

    def round_map(self, slot_ns: int, delay_ns: int = 0) -> Floats:
        """Return the map of z over a round; ValueError unless 0 <= delay_ns < the first control step of a slot."""
        instants = [*control_instants_ns(slot_ns, self.steps, 0), slot_ns]
        if not 0 <= delay_ns < instants[1]:
            raise ValueError(f"delay_ns={delay_ns}: expected 0 <= delay < {instants[1]}, the first step of a slot")
        M, rest = np.eye(self._size), self._after(instants[1] - delay_ns)
        steps = {h_ns: self._after(h_ns) for h_ns in {end_ns - begin_ns for begin_ns, end_ns in pairwise(instants[1:])}}
        for begin_ns, end_ns in pairwise(instants[1:]):
            rest = steps[end_ns - begin_ns] @ rest
        arrival = self._after(delay_ns)
        for slot in range(len(self.parts)):
            at_slot = self._corrected(slot, slot_ns) @ M
            M = rest @ self._taken(slot, at_slot, arrival @ at_slot, delay_ns)
        return M

    def spectral_radius(self, slot_ns: int, delay_ns: int = 0) -> float:
        return spectral_radius(self.round_map(slot_ns, delay_ns))

    def outputs_of(self, z: Floats) -> Floats:
        outputs: Floats = self._C @ z[:self._states]
        return outputs

    # --- z

    @cached_property
    def _states(self) -> int:
        return sum(agent.states for agent in self.agents)

    @cached_property
    def _size(self) -> int:
        sets = 1 if self.hold is Hold.SENDER else len(self.agents)
        return (2 + sets) * self._states + len(self._C)

    @cached_property
    def _C(self) -> Floats:
        return block_diagonal([agent.C for agent in self.agents])

    @cached_property
    def _others(self) -> Floats:
        """The matrix from y^ to s."""
        adjacency = np.diag(np.diag(self.laplacian)) - self.laplacian
        return np.asarray(np.kron(adjacency, np.eye(self.agents[0].outputs)), dtype=float)

    @cached_property
    def _degrees(self) -> Floats:
        return np.asarray(np.kron(np.diag(np.diag(self.laplacian)), np.eye(self.agents[0].outputs)), dtype=float)

    def _rows(self, agent: int) -> slice:
        first = sum(other.states for other in self.agents[:agent])
        return slice(first, first + self.agents[agent].states)

    def _outputs(self, agent: int) -> slice:
        width = self.agents[0].outputs
        return slice(agent * width, (agent + 1) * width)

    def _models(self, robot: int) -> slice:
        """Return the place of the models that `robot` runs."""
        number = 2 + (robot if self.hold is Hold.TEAM else 0)
        return slice(number * self._states, (number + 1) * self._states)

    @property
    def _sums(self) -> slice:
        return slice(self._size - len(self._C), self._size)

    # --- maps

    @cached_property
    def _inputs(self) -> list[tuple[slice, Floats]]:
        """Pairs (rows of z, the matrix from z to the inputs of the agents whose states these rows are)."""
        K = block_diagonal([agent.K for agent in self.agents])
        real = np.zeros((len(K), self._size))
        users = [*range(len(self.agents))]
        for robot in users:
            rows = slice(sum(agent.inputs for agent in self.agents[:robot]),
                         sum(agent.inputs for agent in self.agents[:robot + 1]))
            real[rows, self._models(robot)] = (-K @ (self._degrees - self._others) @ self._C)[rows]
        found = [(slice(0, self._states), real), (slice(self._states, 2 * self._states), real)]
        for robot in users if self.hold is Hold.TEAM else users[:1]:
            assumed = np.zeros((len(K), self._size))
            models = self._models(robot)
            if self.hold is Hold.TEAM:
                assumed[:, models] = -K @ (self._degrees - self._others) @ self._C
            else:
                assumed[:, models] = -K @ self._degrees @ self._C
                assumed[:, self._sums] = K
            found.append((models, assumed))
        return found

    def _after(self, h_ns: int) -> Floats:
        """Return the map of z over h with the inputs of its beginning."""
        steps = [held_input_step(agent.A, agent.B, h_ns * 1e-9) for agent in self.agents]
        Phi, Gamma = block_diagonal([step[0] for step in steps]), block_diagonal([step[1] for step in steps])
        M = np.zeros((self._size, self._size))
        for rows, inputs in self._inputs:
            M[rows] = Gamma @ inputs
            M[rows, rows] += Phi
        M[self._sums, self._sums] = np.eye(len(self._C))
        return M

    def _corrected(self, slot: int, slot_ns: int) -> Floats:
        """Return the jump of the estimates of those that speak in `slot`."""
        M = np.eye(self._size)
        for agent in self.parts[slot]:
            model, rows = self.agents[agent], self._rows(agent)
            LC = observer_gain(model, self.poles[agent], len(self.parts) * slot_ns * 1e-9) @ model.C
            estimate = slice(self._states + rows.start, self._states + rows.stop)
            M[estimate, rows] = LC
            M[estimate, estimate] -= LC
        return M

    def _taken(self, slot: int, at_slot: Floats, now: Floats, delay_ns: int) -> Floats:
        """Return `now` with the frames of `slot` taken; `at_slot` leads to z at the slot's start, `now` to d later."""
        taken = now.copy()
        assumed = {rows.start: inputs for rows, inputs in self._inputs}
        for agent in self.parts[slot]:
            model, rows = self.agents[agent], self._rows(agent)
            Phi, Gamma = held_input_step(model.A, model.B, delay_ns * 1e-9)
            first = sum(other.inputs for other in self.agents[:agent])
            for robot, heard in enumerate(neighbours(self.laplacian)):
                if robot != agent and agent not in heard:
                    continue
                models = self._models(robot)
                v = assumed[models.start][first:first + model.inputs] @ at_slot
                state = at_slot[self._states + rows.start:self._states + rows.stop]
                taken[models.start + rows.start:models.start + rows.stop] = Phi @ state + Gamma @ v
            used = at_slot[self._models(agent)]
            sums = slice(self._sums.start + self._outputs(agent).start, self._sums.start + self._outputs(agent).stop)
            taken[sums] = (self._others @ self._C)[self._outputs(agent)] @ used
        return taken


def slot_limit_ns(loop: ModelLoop, step_ns: int, end_ns: int, delay_ns: int = 0) -> int | None:
    """Scan the slot lengths step, 2 step, ... up to `end_ns` and return the longest stable one before the first loss.

    The loss is refined to 1 ns; None: all scanned are stable. Nothing is known between two scanned slot lengths. The
    scan begins above `loop.steps` times the delay, below which there is no map; 0: its first one is unstable."""
    stable_ns = 0
    for slot_ns in range(step_ns, end_ns + 1, step_ns):
        if slot_ns // loop.steps <= delay_ns:
            continue
        if loop.spectral_radius(slot_ns, delay_ns) < 1:
            stable_ns = slot_ns
            continue
        if not stable_ns:
            return 0
        unstable_ns = slot_ns
        while unstable_ns - stable_ns > 1:
            middle_ns = (stable_ns + unstable_ns) // 2
            if loop.spectral_radius(middle_ns, delay_ns) < 1:
                stable_ns = middle_ns
            else:
                unstable_ns = middle_ns
        return stable_ns
    return None
