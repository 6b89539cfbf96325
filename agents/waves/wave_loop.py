"""The exact map of a round of agents coupled by waves (`port.py`), with the constant delays of a `Network`.

State z = (x of all agents; for each agent the integral of y, and for each line to it that of the incoming wave, since
it sent last; for each line the waves on their way and the one in use):

    x_i' = A_i x_i - kappa deg(i) B_i C_i x_i + alpha B_i sum_j w_ij        w_ij constant between arrivals
    at i's slot: v_ij = (alpha int y_i + rho int w_ij) / tau for each neighbour j; the integrals start anew

tau is the round. At the start nothing is on its way and no wave is in use.
Not modelled: losses (a wave of 0), delays that vary.
"""

from __future__ import annotations

import numpy as np

from agents.synchronization.graph import Floats
from agents.waves.jump_loop import Jump, JumpLoop
from agents.waves.network import Network
from agents.waves.port import WavePort
from agents.waves.registers import Places, Registers, in_order


def wave_loop(network: Network, port: WavePort) -> JumpLoop:
    """Return the loop of `network`, whose agents are those behind the ports, without their damping."""
    places, tau_s = Places(), network.round_ns * 1e-9
    states = places.take(network.all_states)
    outputs = [places.one() for _ in network.agents]
    came_in = {link: places.one() for link in network.delays_ns}
    lines = {link: Registers(places, network.first_ns(link[0]), delay_ns, network.round_ns)
             for link, delay_ns in network.delays_ns.items()}
    A = np.zeros((places.size, places.size))
    sends = []
    for i, agent in enumerate(network.agents):
        here, heard = network.states(i), network.neighbours[i]
        A[here, here] = agent.with_damping(port.own_damping * len(heard)).A
        A[outputs[i], here] = agent.C
        J = np.eye(places.size)
        J[outputs[i]] = 0
        for j in heard:
            A[here, lines[j, i].used] = port.gain * agent.B[:, 0]
            A[came_in[j, i], lines[j, i].used] = 1
            J[came_in[j, i]] = 0
            v = np.zeros(places.size)
            v[[outputs[i], came_in[j, i]]] = port.gain / tau_s, port.reflection / tau_s
            lines[i, j].shift(J, v)
        sends.append(Jump(network.first_ns(i), J))
    arrivals = [line.arrive(places.size) for line in lines.values()]
    resting = network.at_rest()
    agreement = None
    if resting is not None:
        agreement = np.zeros(places.size)
        agreement[states] = resting
        for line in lines.values():
            agreement[list(line.all)] = port.wave_at_rest
        for i, place in enumerate(outputs):
            agreement[place] = tau_s - network.first_ns(i) * 1e-9
            for j in network.neighbours[i]:
                agreement[came_in[j, i]] = agreement[place] * port.wave_at_rest
    return JumpLoop(A, network.round_ns, in_order(sends, arrivals), agreement)


def start(loop: JumpLoop, x0: Floats) -> Floats:
    """Return z just before the first slot."""
    z = np.zeros(len(loop.generator))
    z[:len(x0)] = x0
    return z
