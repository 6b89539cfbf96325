import numpy as np
import pytest

from agents.optimal_triggering.held_loop import HeldLoop, Weights, flow
from agents.tracking.arcs import arc
from agents.tracking.controller import Command, Inputs, Pose, tracking_error
from agents.tracking.error_dynamics import state_rate

LOOP = HeldLoop(Inputs(1.0, 1.0))
EPS = np.finfo(float).eps


def rk4(x, u, inputs, t_s, steps=400):
    """Integrate (4.3) in extended precision: its own error is far below the rounding of a float64."""
    def rate(x):
        x1, x2, x3 = x
        return np.array([u[1] * x2 - u[0] + inputs[0] * np.cos(x3), -u[1] * x1 + inputs[0] * np.sin(x3),
                         inputs[1] - u[1]])

    x, u, inputs = (np.asarray(each, dtype=np.longdouble) for each in (x, u, inputs))
    h = np.longdouble(t_s) / steps
    for _ in range(steps):
        a = rate(x)
        b = rate(x + h / 2 * a)
        c = rate(x + h / 2 * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + rate(x + h * c))
    return x


@pytest.mark.parametrize(("x", "t_s"), [((0.0, 0.0, 0.0), 0.0184), ((0.2, -0.1, 0.3), 0.018), ((1.0, 1.0, 0.5), 0.0182),
                                        ((5.0, 5.0, 1.0), 0.0166)])
def test_the_flow_is_that_of_the_differential_equation(x, t_s):
    u = LOOP.command(np.array(x))

    ours = flow(np.array(x), u, LOOP.inputs(), t_s)

    # rounding of sums of terms as large as |x| and the ways driven
    assert np.abs(ours - rk4(x, u, LOOP.held, t_s)).max() <= 4e-16 * max(1.0, 2 * np.linalg.norm(x))


def test_the_flow_is_that_of_two_robots_on_arcs():
    own, other, u, inputs = Pose(0.0, 0.0, 0.3), Pose(2.0, -1.0, 1.5), Command(1.7, -2.0), Inputs(0.6, 0.15)
    x = np.array(tracking_error(own, other))

    ours = flow(x, np.array(u), np.array(inputs), 1.3)

    assert ours == pytest.approx(tracking_error(arc(own, u, 1.3), arc(other, inputs, 1.3)), abs=20 * EPS)


def test_the_cost_is_the_integral_of_its_rate():
    x, tau_s = np.array([3.0, -2.0, 0.7]), 0.4
    u = LOOP.command(x)
    loop = HeldLoop(LOOP.held, Weights(0.2, 0.05))
    places = np.linspace(0, tau_s, 20_001)
    on_the_way = flow(x[:, None], u[:, None], loop.inputs()[:, None], places)
    rates = 0.2 * (on_the_way ** 2).sum(axis=0) + 0.05 * (u ** 2).sum()

    assert loop.cost(x, u, loop.inputs(), tau_s) == pytest.approx(np.trapezoid(rates, places), rel=1e-7)


def test_the_command_is_that_of_the_robot():
    x = (0.4, -0.3, 0.2)

    assert LOOP.command(np.array(x)) == pytest.approx(LOOP.controller.command(x, LOOP.held), abs=1e-14)
    assert flow(np.array(x), LOOP.command(np.array(x)), LOOP.inputs(), 1e-9) - x == pytest.approx(
        1e-9 * np.array(state_rate(x, LOOP.controller.command(x, LOOP.held), LOOP.held)), abs=1e-15)


def test_weights_that_are_not_positive_are_refused():
    with pytest.raises(ValueError, match=r"q=0.* positive definite"):
        Weights(0.0, 0.1)
