"""Exact maps against event-by-event simulations, and what they say: waves agree whatever the delays are."""

from __future__ import annotations

import numpy as np
import pytest

from agents.waves.network import Network
from agents.waves.output_loop import OutputLoop
from agents.waves.port import WavePort
from agents.waves.wave_loop import start, wave_loop
from tests.agents.waves.conftest import integrator, mass_damper
from tests.agents.waves.simulated import always, simulate_outputs, simulate_waves

SLOT_NS = 20_000_000
SLOTS = (0.1, 0.5, 1, 2, 2.5, 5, 8, 10)


def ring(N):
    lines = {(i, (i + 1) % N) for i in range(N)}
    return sorted(lines | {(j, i) for i, j in lines})


def network(agents, delay_ns=0):
    return Network(tuple(agents), dict.fromkeys(ring(len(agents)), delay_ns), SLOT_NS)


def random_delays(agents, rng):
    """Any delays up to 10 slots; some of whole slots and whole rounds, which end as another slot begins."""
    links = ring(len(agents))
    delays_ns = {link: int(rng.integers(0, 10 * SLOT_NS)) for link in links}
    whole = (0, SLOT_NS, len(agents) * SLOT_NS, 2 * len(agents) * SLOT_NS)
    delays_ns |= {links[k]: int(rng.choice(whole)) for k in range(0, len(links), 2)}
    return Network(tuple(agents), delays_ns, SLOT_NS)


def outputs(net, states):
    return np.stack([states[:, net.states(i)] @ agent.C[0] for i, agent in enumerate(net.agents)], axis=1)


@pytest.mark.parametrize("seed", range(6))
def test_the_wave_loop_is_the_event_by_event_simulation(team_of, seed):
    rng = np.random.default_rng(seed)
    net = random_delays(team_of[2 if seed % 2 else 5], rng)
    K, b = rng.uniform(0.5, 5, size=2)
    x0 = rng.normal(size=net.all_states)
    instants = sorted(int(t) for t in rng.integers(0, 1_000_000_000, 30)) + [1_000_000_000]
    loop = wave_loop(net, WavePort(K, b))

    exact = outputs(net, loop.states_at(start(loop, x0), instants))

    parts = [x0[net.states(i)] for i in range(len(net.agents))]
    told, *_ = simulate_waves(net.agents, ring(len(net.agents)), SLOT_NS, K, b, parts, instants, always(net.delays_ns))
    np.testing.assert_allclose(exact, told, rtol=1e-9, atol=1e-11)
    z = np.linalg.matrix_power(loop.period_map, 1_000_000_000 // net.round_ns) @ start(loop, x0)
    np.testing.assert_allclose(outputs(net, z[None])[0], told[-1], rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("own_late", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_the_output_loop_is_the_event_by_event_simulation(team_of, seed, own_late):
    rng = np.random.default_rng(seed)
    net = random_delays(team_of[2 if seed % 2 else 5], rng)
    K, x0 = rng.uniform(0.5, 3), rng.normal(size=net.all_states)
    instants = sorted(int(t) for t in rng.integers(0, 1_000_000_000, 30))
    loop = OutputLoop(net, K, own_late)

    exact = outputs(net, loop.loop.states_at(loop.start(x0), instants))

    own_ns = [max(delay_ns for link, delay_ns in net.delays_ns.items() if link[1] == i) if own_late else 0
              for i in range(len(net.agents))]
    parts = [x0[net.states(i)] for i in range(len(net.agents))]
    told = simulate_outputs(net.agents, ring(len(net.agents)), SLOT_NS, K, parts, instants, net.delays_ns, own_ns)
    np.testing.assert_allclose(exact, told, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("N", [2, 5])
@pytest.mark.parametrize("slots", SLOTS)
def test_waves_agree_for_every_delay_and_every_gain(team_of, N, slots):
    for K, b in ((2.0, 2.0), (0.5, 5.0), (5.0, 0.5), (100.0, 100.0)):
        loop = wave_loop(network(team_of[N], round(slots * SLOT_NS)), WavePort(K, b))

        assert loop.agrees
        assert loop.radius < 1 - 1e-4


@pytest.mark.parametrize("seed", range(10))
def test_waves_agree_with_other_delays_on_every_link(team_of, seed):
    rng = np.random.default_rng(seed)
    loop = wave_loop(random_delays(team_of[5], rng), WavePort(*rng.uniform(0.5, 10, size=2)))

    assert loop.agrees
    assert loop.radius < 1


def test_held_outputs_with_the_own_value_late_diverge_from_a_delay_on(team_of):
    stable = [slots for slots in range(11)
              if OutputLoop(network(team_of[5], slots * SLOT_NS), 2.0, True).loop.radius < 1]

    assert stable == list(range(9))
    assert OutputLoop(network(team_of[5], 9 * SLOT_NS), 2.0, True).loop.radius == pytest.approx(1.014356, abs=5e-7)


def test_held_outputs_with_the_own_value_at_once_stand_these_delays_but_not_every_gain(team_of):
    """Passive agents turn Remark 7's finding round: their own value at once is the better convention."""
    radii = [OutputLoop(network(team_of[5], round(slots * SLOT_NS)), 2.0, False).loop.radius for slots in SLOTS]

    assert max(radii) < 1
    assert OutputLoop(network(team_of[5], SLOT_NS), 12.0, False).loop.radius > 1
    assert wave_loop(network(team_of[5], SLOT_NS), WavePort(12.0, 12.0)).radius < 1


@pytest.mark.parametrize("slots", [0.1, 1, 10])
def test_integrators_agree_on_the_value_that_fills_the_lines_too(slots):
    """x_i' = kappa sum (w-part - x_i): with b = K the sum of x and of K/2 times what is on its way is kept.

    A line of delay d holds, at agreement on c, K/2 c (d + tau): tau/2 more by the mean, tau/2 by its use. At the
    start it holds nothing."""
    K, x0 = 2.0, np.array([4.0, -1.0, 2.0])
    net = Network((integrator(),) * 3, dict.fromkeys(ring(3), round(slots * SLOT_NS)), SLOT_NS)
    loop = wave_loop(net, WavePort(K, K))

    reached = loop.limit(start(loop, x0))

    in_lines_s = 6 * (slots * SLOT_NS + net.round_ns) * 1e-9
    assert reached == pytest.approx(x0.sum() / (3 + K / 2 * in_lines_s), rel=1e-9)
    far = loop.states_at(start(loop, x0), [60_000_000_000])[0, :3]
    np.testing.assert_allclose(far, reached, rtol=1e-9)


def test_two_teams_that_do_not_hear_each_other_do_not_agree():
    pairs = {(0, 1): 5, (1, 0): 5, (2, 3): 5, (3, 2): 5}

    assert wave_loop(Network((integrator(),) * 4, pairs, SLOT_NS), WavePort(1.0, 1.0)).radius == pytest.approx(1.0)


def test_agents_that_rest_at_zero_only_have_no_agreement_to_leave_out():
    leaky = integrator().with_damping(0.5)

    loop = wave_loop(network([leaky, mass_damper(1.0, 2.0, 1.0)]), WavePort(1.0, 1.0))

    assert loop.agreement is None
    assert loop.radius < 1


def test_a_line_has_two_ends_and_no_negative_delay():
    with pytest.raises(ValueError, match="opposite link"):
        Network((integrator(),) * 2, {(0, 1): 5}, SLOT_NS)
    with pytest.raises(ValueError, match="expected 0 or more"):
        Network((integrator(),) * 2, {(0, 1): 5, (1, 0): -1}, SLOT_NS)
