from __future__ import annotations

from itertools import product
from math import pi, sin

import numpy as np
import pytest

from agents.synchronization.check import stable_delay
from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.delayed_loop import DelayedLoop, Delays
from agents.synchronization.exact_loop import ExactLoop
from agents.synchronization.graph import edges, laplacian, neighbours
from agents.synchronization.partition import partition
from agents.synchronization.slot_length import small_gain_tau_s
from tests.agents.synchronization.exact_run import _held_input_step


def delayed(agents, L, slot_ns, delay_ns, own_ns=None):
    """The loop with one delay on all links; the senders' own values are as late unless `own_ns` is given."""
    own = delay_ns if own_ns is None else own_ns
    return DelayedLoop(agents, L, slot_ns, Delays(dict.fromkeys(edges(L), delay_ns), (own,) * len(L)))


def simulated(agents, L, slot_ns, delays, x0, slots):
    """x after a number of slots, event by event with one held value for each user of each value: no map of a round."""
    parts = partition(L)
    users = {(j, i): delay_ns for (j, i), delay_ns in delays.link_ns.items()}
    users |= {(i, i): delay_ns for i, delay_ns in enumerate(delays.own_ns)}
    x = np.split(x0, np.cumsum([agent.states for agent in agents])[:-1])
    held = {user: agents[user[0]].C @ x[user[0]] for user in users}
    due = [(slot * slot_ns, 0, j) for slot in range(slots) for j in parts[slot % len(parts)]]
    coming, now_ns = [(slots * slot_ns, 2, None)], 0
    while now_ns < slots * slot_ns:
        at_ns, kind, what = min([*due, *((t, k, None) for t, k, _ in coming)], key=lambda event: event[:2])
        for i, (agent, heard) in enumerate(zip(agents, neighbours(L), strict=True)):
            u = -agent.K @ sum((held[i, i] - held[j, i] for j in heard), start=np.zeros(agent.outputs))
            Phi, Gamma = _held_input_step(agent.A, agent.B, (at_ns - now_ns) * 1e-9)
            x[i] = Phi @ x[i] + Gamma @ u
        now_ns = at_ns
        if kind == 0 and at_ns < slots * slot_ns:
            due.remove((at_ns, 0, what))
            coming += [(at_ns + delay_ns, 1, (user, agents[what].C @ x[what]))
                       for user, delay_ns in users.items() if user[0] == what]
        for event in [event for event in coming if event[:2] == (at_ns, 1)]:
            coming.remove(event)
            user, value = event[2]
            held[user] = value
    return np.concatenate(x)


@pytest.mark.parametrize("number", [0, 1])
def test_below_a_slot_it_is_the_exact_loop(five_agents, l1, l2, number):
    L = (l1, l2)[number]
    exact = ExactLoop(five_agents, L, partition(L))

    for delay_ns in (0, 1, 400_000, 999_999):
        assert delayed(five_agents, L, 1_000_000, delay_ns).spectral_radius() == pytest.approx(
            exact.spectral_radius(1e-3, delay_ns * 1e-9), rel=1e-13)


@pytest.mark.parametrize("seed", range(4))
def test_any_delays_of_links_and_senders_give_the_states_of_an_event_by_event_simulation(five_agents, l1, l2, seed):
    rng, slot_ns, rounds = np.random.default_rng(seed), 1_100_000, 8
    L = (l1, l2)[seed % 2]
    links_ns = {link: int(rng.integers(0, 9 * slot_ns)) for link in edges(L)}
    whole = list(links_ns)[:3]                  # delays of whole slots, which end as another slot begins
    links_ns |= {link: slots * slot_ns for link, slots in zip(whole, (1, 3, 7), strict=True)}
    loop = DelayedLoop(five_agents, L, slot_ns, Delays(links_ns, [int(d) for d in rng.integers(0, 5 * slot_ns, 5)]))
    x0 = rng.normal(size=10)

    z = np.linalg.matrix_power(loop.round_map(), rounds) @ loop.start(x0)

    expected = simulated(five_agents, L, slot_ns, loop.delays, x0, 3 * rounds)
    np.testing.assert_allclose(z[:10], expected, rtol=1e-9, atol=1e-11)


def test_agents_with_two_outputs_are_simulated_too():
    rng = np.random.default_rng(15)
    agents = tuple(LinearAgent(rng.normal(size=(n, n)), rng.normal(size=(n, 1)), rng.normal(size=(2, n)),
                               rng.normal(size=(1, 2))) for n in (2, 3, 1))
    L = laplacian(3, [(0, 1), (1, 2), (2, 0)])
    loop, x0 = delayed(agents, L, 3_000_000, 13_000_000, 2_000_000), rng.normal(size=6)

    z = np.linalg.matrix_power(loop.round_map(), 5) @ loop.start(x0)

    slots = 5 * len(partition(L))
    np.testing.assert_allclose(z[:6], simulated(agents, L, 3_000_000, loop.delays, x0, slots), rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("m", [1, 2, 3, 7])
def test_an_integrator_that_uses_its_own_value_m_rounds_late_has_the_limit_of_the_closed_form(m):
    """x+ = x - k h x(m rounds ago): z^(m+1) - z^m + k h = 0, stable if and only if k h < 2 sin(pi / (4 m + 2))."""
    slot_ns = 10_000_000
    h_s = 2 * slot_ns * 1e-9                            # leader and follower do not share a slot
    leader = LinearAgent([[-1.0]], [[1.0]], [[1.0]], [[1.0]])

    def radius(share):
        follower = LinearAgent([[0.0]], [[1.0]], [[1.0]], [[share * 2 * sin(pi / (4 * m + 2)) / h_s]])
        return delayed((leader, follower), laplacian(2, [(0, 1)]), slot_ns, slot_ns, m * 2 * slot_ns).spectral_radius()

    assert radius(0.999) < 1 < radius(1.001)


@pytest.mark.parametrize(("number", "own_late", "most_slots"), [(0, True, 15), (0, False, 5), (1, True, 16),
                                                                (1, False, 3)])
def test_an_own_value_as_late_as_the_others_stands_longer_delays(five_agents, l1, l2, loop1, loop2, number, own_late,
                                                                most_slots):
    L = (l1, l2)[number]
    slot_ns = round(small_gain_tau_s((loop1, loop2)[number], 3) * 1e9)

    stable = [m for m in range(25)
              if delayed(five_agents, L, slot_ns, m * slot_ns, None if own_late else 0).spectral_radius() < 1]

    assert stable == list(range(most_slots + 1))


@pytest.mark.parametrize(("number", "slot_ns", "own_late", "slots"), [
    (0, 1_084_826, True, 15.08), (0, 1_084_826, False, 5.839), (1, 870_203, True, 16.45), (1, 870_203, False, 3.308)])
def test_the_limits_that_the_pages_give_in_slots(five_agents, l1, l2, number, slot_ns, own_late, slots):
    loop = delayed(five_agents, (l1, l2)[number], slot_ns, 24 * slot_ns, None if own_late else 0)

    assert float(f"{loop.longest_stable_ns / slot_ns:.4g}") == slots


def test_the_spectral_radii_of_the_first_delays(five_agents, l1, loop1):
    slot_ns = round(small_gain_tau_s(loop1, 3) * 1e9)

    radii = [delayed(five_agents, l1, slot_ns, m * slot_ns).spectral_radius() for m in range(6)]

    np.testing.assert_allclose(radii, [.998271, .998328, .998386, .998443, .998502, .998560], atol=5e-7)


def test_registers_hold_what_is_on_its_way(five_agents, l1):
    for delay_ns, depth in ((0, 1), (1, 2), (3_000_000, 2), (3_000_001, 3)):
        loop = delayed(five_agents, l1, 1_000_000, delay_ns)
        assert (loop.depths, loop.size) == ([depth] * 5, 10 + 5 * depth)


def test_a_negative_delay_is_refused():
    for link_ns, own_ns in product((5, -1), (5, -1)):
        if min(link_ns, own_ns) < 0:
            with pytest.raises(ValueError, match="expected 0 or more"):
                Delays({(0, 1): link_ns}, (0, own_ns))


def test_a_delay_may_need_shorter_slots_and_for_a_longer_one_none_is_short_enough(five_agents, l1):
    """17 ms, own value as late, slots of (6.20): unstable, but not with half as long slots; 20 ms: with none tried."""
    loop, hopeless = delayed(five_agents, l1, 1_084_826, 17_000_000), delayed(five_agents, l1, 1_084_826, 20_000_000)

    assert loop.stable_slot_ns == 542_413
    assert not loop.is_stable
    assert delayed(five_agents, l1, 542_413, 17_000_000).is_stable
    assert not delayed(five_agents, l1, 1_084_826 // 16, 20_000_000).is_stable       # shorter than any that is tried
    assert hopeless.stable_slot_ns is None
    assert stable_delay(loop).endswith("and with this delay if slots last 0.542413 ms")
    assert stable_delay(hopeless).endswith("with this delay no slot length tried is stable, 0.135603 ms to 4.339304 ms")
