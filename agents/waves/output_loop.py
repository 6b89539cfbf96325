"""The exact map of a round of agents that hold each other's outputs as they are sent, for comparison with waves.

    x_i' = A_i x_i + K B_i sum_{j in N_i} (s_ij - s_ii)             (6.11); at i's slot it sends y_i

s_ij is the value of j that i uses: that sent last, a delay ago. Its own value s_ii it uses at once, or as late as the
latest of its neighbours' (`own_late`). At the start each robot knows every y(0).
Not modelled: losses, delays that vary.
"""

from __future__ import annotations

import numpy as np

from agents.synchronization.graph import Floats
from agents.waves.jump_loop import Jump, JumpLoop
from agents.waves.network import Network
from agents.waves.registers import Places, Registers, in_order


def own_delay_ns(network: Network, agent: int, own_late: bool) -> int:
    return max(network.delays_ns[j, agent] for j in network.neighbours[agent]) if own_late else 0


class OutputLoop:
    """`loop` is the exact loop, `start` its state just before the first slot."""

    def __init__(self, network: Network, damping: float, own_late: bool) -> None:
        places = Places()
        states = places.take(network.all_states)
        delays_ns = {**network.delays_ns, **{(i, i): own_delay_ns(network, i, own_late)
                                            for i in range(len(network.agents))}}
        self._lines = {user: Registers(places, network.first_ns(user[0]), delay_ns, network.round_ns)
                       for user, delay_ns in delays_ns.items()}
        A = np.zeros((places.size, places.size))
        sends = []
        for i, agent in enumerate(network.agents):
            here, heard = network.states(i), network.neighbours[i]
            A[here, here] = agent.A
            A[here, self._lines[i, i].used] = -damping * len(heard) * agent.B[:, 0]
            J, y = np.eye(places.size), np.zeros(places.size)
            y[here] = agent.C[0]
            for j in heard:
                A[here, self._lines[j, i].used] = damping * agent.B[:, 0]
            for j in (*heard, i):
                self._lines[i, j].shift(J, y)
            sends.append(Jump(network.first_ns(i), J))
        arrivals = [line.arrive(places.size) for line in self._lines.values()]
        resting = network.at_rest()
        agreement = None
        if resting is not None:
            agreement = np.ones(places.size)
            agreement[states] = resting
        self._network = network
        self.loop = JumpLoop(A, network.round_ns, in_order(sends, arrivals), agreement)

    def start(self, x0: Floats) -> Floats:
        z = np.zeros(len(self.loop.generator))
        z[:len(x0)] = x0
        for (sender, _), line in self._lines.items():
            z[list(line.all)] = (self._network.agents[sender].C @ x0[self._network.states(sender)])[0]
        return z
