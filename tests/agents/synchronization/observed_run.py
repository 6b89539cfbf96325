"""A run of agents with observers, event by event, exact at integer nanoseconds: the reference for the exact maps.

Fixed topology; every agent uses every y(0) until a later value is due. Noises are those of each round, an entry for
each agent; frames take `delay_ns`, less than a slot. Observers are those of the robots; everything else is its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.graph import Floats, neighbours
from agents.synchronization.observer import Observer
from agents.synchronization.partition import Parts
from tests.agents.synchronization.exact_run import _held_input_step


def simulate_observed(agents: Sequence[LinearAgent], laplacian: Floats, parts: Parts, poles: Sequence[Sequence[float]],
                      slot_ns: int, delay_ns: int, x0: Floats, xh0: Floats, noises: Floats) -> tuple[Floats, Floats]:
    """Return x and xh after len(noises) rounds."""
    ends = np.cumsum([agent.states for agent in agents])[:-1]
    x = np.split(x0, ends)
    observers = [Observer(agent, pole, start.tolist(), 0)
                 for agent, pole, start in zip(agents, poles, np.split(xh0, ends), strict=True)]
    for observer in observers:
        observer.expect_corrections_every(len(parts) * slot_ns)
    held = [agent.C @ state for agent, state in zip(agents, x, strict=True)]
    steps = {h_ns: [_held_input_step(agent.A, agent.B, h_ns * 1e-9) for agent in agents]
             for h_ns in {delay_ns, slot_ns - delay_ns}}

    def flow(now_ns: int, h_ns: int) -> None:
        for i, (agent, heard) in enumerate(zip(agents, neighbours(laplacian), strict=True)):
            u = -agent.K @ sum((held[i] - held[j] for j in heard), start=np.zeros(agent.outputs))
            observers[i].set_input(now_ns, u.tolist())
            Phi, Gamma = steps[h_ns][i]
            x[i] = Phi @ x[i] + Gamma @ u

    now_ns = 0
    for nu in noises:
        for part in parts:
            for i in part:
                observers[i].correct(now_ns, agents[i].C @ x[i] + nu[i])
            values = {i: agents[i].C @ observers[i].estimate for i in part}
            flow(now_ns, delay_ns)
            for i, value in values.items():
                held[i] = value
            flow(now_ns + delay_ns, slot_ns - delay_ns)
            now_ns += slot_ns
    for observer, agent in zip(observers, agents, strict=True):
        observer.set_input(now_ns, np.zeros(agent.inputs).tolist())
    return np.concatenate(x), np.concatenate([observer.estimate for observer in observers])
