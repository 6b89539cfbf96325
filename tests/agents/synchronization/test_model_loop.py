from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.exact_loop import ExactLoop, spectral_radius
from agents.synchronization.graph import laplacian
from agents.synchronization.matrix_exponential import matrix_exponential
from agents.synchronization.model_hold import Hold, ModelHold, control_instants_ns
from agents.synchronization.model_loop import ModelLoop, slot_limit_ns
from agents.synchronization.observer import observer_gain
from agents.synchronization.partition import partition
from tests.agents.synchronization.exact_run import _held_input_step
from tests.agents.synchronization.test_observed_loop import nearest

POLES = [[-20.0, -24.0], [-20.0], [-20.0, -24.0], [-20.0, -24.0], [-20.0]]
MODELS = [Hold.SENDER, Hold.TEAM]


def model_loop(agents, L, hold, steps=4):
    return ModelLoop(agents, L, partition(L), POLES, hold, steps)


@pytest.mark.parametrize("hold", MODELS)
@pytest.mark.parametrize(("steps", "delay_ns"), [(1, 0), (4, 0), (3, 400_000)])
def test_powers_of_the_round_map_are_robots_that_run_models(five_agents, l1, l2, hold, steps, delay_ns):
    """Event by event, each robot with the models that the programs run; plants and observers are stepped here."""
    slot_ns, rounds = 5_000_001, 6
    for L in (l1, l2):
        loop, rng = model_loop(five_agents, L, hold, steps), np.random.default_rng(1)
        x0, xh0 = rng.normal(size=10), rng.normal(size=10)
        ends = np.cumsum([agent.states for agent in five_agents])[:-1]
        x, xh = np.split(x0, ends), np.split(xh0, ends)
        robots = [ModelHold(i, five_agents, L, [(0.0,)] * 5, hold, xh, delay_ns) for i in range(5)]
        now_ns = 0
        for slot in range(3 * rounds):
            frames = {}
            for i in loop.parts[slot % 3]:
                L_i = observer_gain(five_agents[i], POLES[i], 3 * slot_ns * 1e-9)
                xh[i] = xh[i] + L_i @ (five_agents[i].C @ (x[i] - xh[i]))
                frames[i] = robots[i].frame_values(now_ns, xh[i], 4)
            instants = [*control_instants_ns(slot_ns, steps, delay_ns), slot_ns]
            for begin_ns, end_ns in pairwise(instants):
                for i, robot in enumerate(robots):
                    if begin_ns == delay_ns:
                        for sender, values in frames.items():
                            robot.take(now_ns + begin_ns, sender, values)
                    robot.control(now_ns + begin_ns, begin_ns == 0)
                    y, agent = robot.outputs(now_ns + begin_ns), five_agents[i]
                    u = -agent.K @ sum((np.array(y[i]) - y[j] for j in y if j != i), start=np.zeros(1))
                    Phi, Gamma = _held_input_step(agent.A, agent.B, (end_ns - begin_ns) * 1e-9)
                    x[i], xh[i] = Phi @ x[i] + Gamma @ u, Phi @ xh[i] + Gamma @ u
            now_ns += slot_ns

        z = np.linalg.matrix_power(loop.round_map(slot_ns, delay_ns), rounds) @ loop.start(x0, xh0)

        np.testing.assert_allclose(z[:10], np.concatenate(x), rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(z[10:20], np.concatenate(xh), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("hold", MODELS)
def test_the_observers_add_their_spectrum_and_nothing_else(five_agents, l1, hold):
    """Other poles leave all other eigenvalues where they are."""
    slot_ns = 10_000_000
    slow = ModelLoop(five_agents, l1, partition(l1), [[pole / 2 for pole in poles] for poles in POLES], hold, 4)

    fast_values = np.linalg.eigvals(model_loop(five_agents, l1, hold).round_map(slot_ns))
    slow_values = np.linalg.eigvals(slow.round_map(slot_ns))

    def without(values, poles):
        left = list(values)
        for value in np.exp(np.concatenate(poles) * 3 * slot_ns * 1e-9):
            left.remove(min(left, key=lambda other: abs(other - value)))
        return [value for value in left if abs(value) > 0.05]

    assert nearest(without(fast_values, POLES), without(slow_values, slow.poles)) < 1e-6


@pytest.mark.parametrize(("number", "hold", "steps", "expected_ns", "end_ns"), [
    (0, Hold.SENDER, 1, 26_871_119, 30_000_000), (0, Hold.SENDER, 4, 28_155_968, 30_000_000),
    (1, Hold.SENDER, 1, 25_630_774, 30_000_000), (1, Hold.SENDER, 4, 29_198_763, 30_000_000),
    (0, Hold.TEAM, 1, 23_539_485, 25_000_000)])
def test_the_limits_of_the_slot_length(five_agents, l1, l2, number, hold, steps, expected_ns, end_ns):
    """Expected: maps of robots that know their states, built independently with one matrix for a whole slot."""
    found = slot_limit_ns(model_loop(five_agents, (l1, l2)[number], hold, steps), 500_000, end_ns)

    assert found == pytest.approx(expected_ns, abs=2)


def test_with_models_of_the_whole_team_slots_of_100_ms_are_nearly_the_continuous_loop(five_agents, loop1):
    """Montestruque and Antsaklis: a model that knows all inputs is right for ever, so only the control steps matter."""
    continuous = spectral_radius(matrix_exponential(loop1.A_cl * 0.3))

    radii = [model_loop(five_agents, loop1.laplacian, Hold.TEAM, steps).spectral_radius(100_000_000)
             for steps in (8, 16, 32)]

    distances = [radius - continuous for radius in radii]
    assert radii[-1] == pytest.approx(continuous, rel=0.02)
    for longer, shorter in pairwise(distances):
        assert 0 < shorter < 0.6 * longer           # the error of a held input is of the order of the step


def test_a_sender_without_neighbours_is_predicted_without_error():
    """The only input of a leader is its own law, so the follower's model is right and only the control steps matter."""
    leader = LinearAgent([[-1.0]], [[1.0]], [[1.0]], [[1.0]])
    follower = LinearAgent([[0.0]], [[1.0]], [[1.0]], [[4.0]])
    L = laplacian(2, [(0, 1)])
    poles = [[-5.0], [-5.0]]
    plain = ExactLoop((leader, follower), L, partition(L))

    assert plain.spectral_radius(0.3) > 1          # x+ = (1 - k T tau) x: unstable from 0.25 s on
    assert ModelLoop((leader, follower), L, partition(L), poles, Hold.SENDER, 8).spectral_radius(300_000_000) < 1


def test_a_scan_without_a_limit_and_an_unstable_start_are_said(five_agents, l1):
    loop = model_loop(five_agents, l1, Hold.SENDER)

    assert slot_limit_ns(loop, 1_000_000, 5_000_000) is None
    assert slot_limit_ns(loop, 29_000_000, 30_000_000) == 0
    assert slot_limit_ns(loop, 1_000_000, 5_000_000, 400_000) is None
    with pytest.raises(ValueError, match="delay_ns=500000: expected 0 <= delay < 500000, the first step of a slot"):
        loop.round_map(2_000_000, 500_000)


def test_frames_of_robots_that_are_not_heard_change_nothing(five_agents, l1):
    starts = [np.ones(agent.states) for agent in five_agents]
    robot = ModelHold(1, five_agents, l1, [(0.0,)] * 5, Hold.SENDER, starts, 0)
    before = robot.outputs(0)

    robot.take(0, 0, [9.0] * 4)

    assert robot.outputs(0) == before
    assert set(before) == {1, 2}
    robot.take(0, 2, [5.0, 7.0, 0.0, 1.0])
    assert robot.outputs(0)[2] == pytest.approx((12.0,))


def test_a_control_instant_before_the_frame_that_comes_at_it_changes_nothing(five_agents, l1):
    """Own timers and arrivals share an instant; a frame moves with the inputs of the slot's start in either order."""
    starts, delay_ns, frame = [np.ones(agent.states) for agent in five_agents], 400_000, [5.0, 7.0, 0.0, 1.0]
    first, last = (ModelHold(1, five_agents, l1, [(0.0,)] * 5, Hold.SENDER, starts, delay_ns) for _ in range(2))
    for robot in (first, last):
        robot.control(0, True)

    first.take(delay_ns, 2, frame)
    first.control(delay_ns, False)
    last.control(delay_ns, False)
    last.take(delay_ns, 2, frame)

    assert first.outputs(delay_ns) == last.outputs(delay_ns)
    assert first.outputs(9_000_000) == last.outputs(9_000_000)
    late = ModelHold(1, five_agents, l1, [(0.0,)] * 5, Hold.SENDER, [9 * start for start in starts], delay_ns)
    late.control(0, True)
    late.take(delay_ns, 2, frame)
    assert late.outputs(delay_ns)[2] != first.outputs(delay_ns)[2]         # other inputs at the slot's start
