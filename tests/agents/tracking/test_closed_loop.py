from itertools import pairwise
from math import pi
from random import Random

import numpy as np
import pytest
import scipy.integrate

from agents.tracking.arcs import arc, ramp
from agents.tracking.closed_loop import MS, run
from agents.tracking.controller import Command, Inputs, Pose, TrackingController
from agents.tracking.error_dynamics import state_rate
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.noise import Noise
from agents.tracking.reference_inputs import Piece, ReferenceInputs
from agents.tracking.section_4_6 import GAINS, LENGTH_NS, REFERENCE, START
from agents.triggering.assumptions import Assumption, violations
from agents.triggering.error_gain import KAPPA
from agents.triggering.policies.input_output import IndividualGains
from agents.triggering.policies.table import POLICIES, PolicySettings, build_policy

SYSTEM = TrackingErrorSystem()
SECOND = 10**9


def policy(name, losses=0):
    return build_policy(name, SYSTEM, GAINS, PolicySettings(max_successive_losses=losses))


def noise(seed=1, **settings):
    return Noise(Random(2 * seed), Random(2 * seed + 1), **settings)


def made(name, start=START, losses=0, seed=1, length_ns=LENGTH_NS, **settings):
    return run(policy(name, losses), REFERENCE, start, length_ns, noise=noise(seed), **settings)


@pytest.fixture(scope="module")
def individual():
    return made("individual_gains")


@pytest.fixture(scope="module")
def unified():
    return made("unified_gain")


def test_the_loop_is_the_integral_of_the_error_dynamics(individual):
    """(4.3) in the frame of R1 by DOP853, against two robots in the plane: other coordinates, other method."""
    disturbance = noise()
    sent = individual.transmissions
    ends_ns = [after.t_ns for after in sent[1:]] + [LENGTH_NS]
    x = np.array(START)
    furthest = 0.0
    for now, end_ns in zip(sent[:120], ends_ns, strict=False):
        furthest = max(furthest, float(np.abs(x - now.x).max()))
        knots = [now.t_ns, *(t for t in range(0, end_ns, disturbance.knot_ns) if now.t_ns < t), end_ns]
        held = REFERENCE.at(now.t_ns)
        for a_ns, b_ns in pairwise(knots):
            before, after = disturbance.input_error(a_ns), disturbance.input_error(b_ns)

            def rate(t, z, command=now.command, held=held, before=before, after=after, length_s=(b_ns - a_ns) * 1e-9):
                share = t / length_s
                real = [h - (1 - share) * p - share * q for h, p, q in zip(held, before, after, strict=True)]
                return state_rate(tuple(z), command, Inputs(*real))

            x = scipy.integrate.solve_ivp(rate, (0.0, (b_ns - a_ns) * 1e-9), x, method="DOP853", rtol=1e-12,
                                          atol=1e-13).y[:, -1]

    assert len(sent) > 120
    assert furthest < 1e-9              # derived in `closed_loop`: 3e-8 for 240 steps of 50 ms, h^7; here below 20 ms


def test_commands_follow_from_what_was_measured_and_not_from_what_is_true(individual):
    for sent in individual.transmissions:
        assert sent.command == TrackingController().command(sent.measured, REFERENCE.at(sent.t_ns))
        off = np.abs(np.array(sent.measured) - sent.x)
        assert off.max() <= 0.15
    spread = np.array([np.array(sent.measured) - sent.x for sent in individual.transmissions])
    n = len(spread)
    assert np.abs(spread.mean(axis=0)).max() < 4 * 0.15 / (3 * n) ** 0.5            # uniform: sigma = a / sqrt(3)
    assert spread.std() == pytest.approx(0.15 / 3**0.5, rel=4 / (2 * 3 * n) ** 0.5)


def test_transmissions_are_where_the_policy_and_the_reference_put_them(individual):
    sent = individual.transmissions

    assert [one.t_ns for one in sent if one.forced] == [2_260_000_000, 9_250_000_000]
    for before, after in pairwise(sent):
        assert after.forced or after.t_ns == before.decision.next_ns
        assert after.t_ns <= before.decision.holds_until_ns
    assert sent[0].t_ns == 0
    assert sent[-1].t_ns < LENGTH_NS <= sent[-1].decision.next_ns


def test_transmissions_of_the_12_s_run(individual, unified):
    """Issue and NUMBERS: 440-460 and 1185-1215, ratio 2.60-2.70; the printed 580 and 1377 do not come out."""
    assert 440 <= len(individual.transmissions) <= 460
    assert 1185 <= len(unified.transmissions) <= 1215
    assert 2.60 <= len(unified.transmissions) / len(individual.transmissions) <= 2.70


def test_the_gains_alone_ask_for_most_of_them(individual, unified):
    pieces_s = {(1.0, 1.0): 2.26, (0.6, 0.15): 6.99, (2.0, 2.0): 2.75}
    least = sum(length_s * GAINS.gain(inputs) / KAPPA for inputs, length_s in pieces_s.items())

    assert least == pytest.approx(428.0, abs=0.05)
    assert 12 * GAINS.unified / KAPPA == pytest.approx(1153.2, abs=0.05)
    assert least < len(individual.transmissions) < 1.08 * least
    assert 1153.2 < len(unified.transmissions) < 1.08 * 1153.2


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (0.0, -10.0, 0.0), (-5.0, 7.0, 2.0),
                                   (6.0, 6.0, -3.0), (-1.09, 7.74, -3.34)])
def test_wherever_it_starts_the_ratio_of_transmissions_is_the_same(start):
    """The last two are among the slowest to converge: up to 2 % above the range that holds for nearly all others.

    So it is with the true states and the printed matrix too (463 and 1228 for the last): it is not this trigger.
    """
    one, all_ = len(made("individual_gains", start).transmissions), len(made("unified_gain", start).transmissions)

    assert 440 <= one <= 460 * 1.02
    assert 1185 <= all_ <= 1215 * 1.02
    assert 2.60 <= all_ / one <= 2.70


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_the_range_of_the_intervals_near_the_reference(seed):
    start = tuple(3 * c for c in ((0.6, 0.8, 0.0), (0.0, 0.6, 0.8), (-0.6, 0.0, -0.8))[seed - 2])

    intervals_ms = [ns / 1e6 for ns in made("individual_gains", start, seed=seed).intervals_ns]

    assert min(intervals_ms) == pytest.approx(17.1, abs=0.3)
    assert max(intervals_ms) == pytest.approx(43.4, abs=0.3)


def test_the_robot_has_caught_up_with_the_reference(individual, unified):
    for one in (individual, unified):
        assert one.rms(10 * SECOND, 12 * SECOND) < 0.1
        assert one.samples[0].x == pytest.approx(START)


def test_without_noise_the_error_tends_to_that_of_the_held_measurements_alone():
    quiet = run(policy("individual_gains"), REFERENCE, START, LENGTH_NS)

    assert quiet.rms(10 * SECOND, 12 * SECOND) < 0.02
    assert all(sent.measured == sent.x for sent in quiet.transmissions)


@pytest.mark.parametrize("name", sorted(POLICIES.keys() - {"optimal"}))       # that one: test_optimal_tables.py
def test_with_every_policy_what_holds_is_certified_at_every_instant(name):
    one = made(name, length_ns=3 * SECOND)

    sent = one.transmissions
    for before, after in pairwise(sent):
        assert violations(before.decision, after.t_ns) == []
        assert before.decision.gain_product(after.t_ns) <= KAPPA * (1 + 1e-9)
    assert [s.t_ns for s in one.samples] == [k * 10 * MS for k in range(301)]


def test_constant_monitoring_saves_next_to_nothing():
    """What has to be feared within 40 ms is hardly more than what happens: prediction costs less than 1 %."""
    predicted, watched = (len(made(name).transmissions) for name in ("individual_gains", "event_triggered"))

    assert 0.99 * predicted <= watched <= predicted


def test_a_certified_period_costs_three_times_as_much(individual):
    periodic = made("periodic")

    assert len(set(periodic.intervals_ns)) == 1
    assert len(periodic.transmissions) > 3 * len(individual.transmissions)


@pytest.mark.parametrize("losses", [1, 3])
def test_with_as_many_losses_in_a_row_as_allowed_for_the_information_stays_fresh(losses):
    lossy = made("individual_gains", losses=losses, lost=lambda k: k % (losses + 1) != 0)

    arrived = [sent for sent in lossy.transmissions if sent.measured is not None]
    for before, after in pairwise(arrived):
        assert violations(before.decision, after.t_ns) == []
    assert len(lossy.transmissions) > 0.9 * (losses + 1) * len(arrived)
    assert lossy.rms(10 * SECOND, 12 * SECOND) < 0.1


def test_one_more_loss_in_a_row_is_named_at_its_time():
    lossy = made("individual_gains", losses=1, lost=lambda k: k in (40, 41))

    before = lossy.transmissions[39].decision
    again = lossy.transmissions[42]
    assert [sent.measured is None for sent in lossy.transmissions[39:43]] == [False, True, True, False]
    broken = violations(before, again.t_ns, failed_attempts=2)
    assert {violation.assumption for violation in broken} >= {Assumption.FRESH, Assumption.LOSSES}
    assert min(violation.at_ns for violation in broken) == lossy.transmissions[41].t_ns


def test_a_lost_announcement_leaves_the_old_inputs_in_force():
    number = next(k for k, sent in enumerate(made("individual_gains").transmissions) if sent.forced)
    lossy = made("individual_gains", lost=lambda k: k == number)

    missed, after = lossy.transmissions[number:number + 2]
    assert missed.forced
    assert missed.command == lossy.transmissions[number - 1].command
    assert after.decision.gain_per_s == 22.0
    assert missed.decision.gain_per_s == 53.0
    assert after.t_ns == missed.decision.next_ns            # the announcement was no attempt of the robot's own


def test_the_same_streams_give_the_same_run():
    assert made("individual_gains", length_ns=SECOND) == made("individual_gains", length_ns=SECOND)
    assert made("individual_gains", length_ns=SECOND) != made("individual_gains", length_ns=SECOND, seed=2)


def test_samples_do_not_disturb_the_run():
    coarse, fine = (made("individual_gains", length_ns=SECOND, sample_ns=ns) for ns in (SECOND, MS))

    assert [s.t_ns for s in coarse.samples] == [0, SECOND]
    assert len(fine.samples) == 1001
    for a, b in zip(coarse.transmissions, fine.transmissions, strict=True):
        assert a.t_ns == pytest.approx(b.t_ns, abs=2)               # x may differ by rounding
        assert a.x == pytest.approx(b.x, abs=1e-8)


def test_the_disturbance_of_the_inputs_is_continuous_and_bounded():
    disturbance = noise()
    values = np.array([disturbance.input_error(k * MS) for k in range(3001)])

    assert np.abs(values).max() <= 0.3
    assert np.abs(np.diff(values, axis=0)).max() <= 0.6 / 100 * 1.0001      # a full swing within 100 ms
    assert np.abs(values[::100]).max() > 0.2


@pytest.mark.parametrize("h_s", [0.05, 0.01])
def test_an_arc_and_a_ramp_are_the_integrals_of_the_unicycle(h_s):
    start = Pose(1.0, -2.0, 0.7)
    before, after = Inputs(3.3, -3.3), Inputs(3.0, -3.0)                    # e_omega' = 6 per s

    def driven(first, last):
        def rate(t, z):
            share = t / h_s
            v, omega = ((1 - share) * a + share * b for a, b in zip(first, last, strict=True))
            return [v * np.cos(z[2]), v * np.sin(z[2]), omega]

        return scipy.integrate.solve_ivp(rate, (0, h_s), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]

    np.testing.assert_allclose(arc(start, Command(4.0, 9.0), h_s), driven((4.0, 9.0), (4.0, 9.0)), atol=1e-12)
    np.testing.assert_allclose(arc(start, Command(4.0, 0.0), h_s), driven((4.0, 0.0), (4.0, 0.0)), atol=1e-12)
    np.testing.assert_allclose(ramp(start, before, after, h_s), driven(before, after),
                               atol=3e5 * h_s**7 / 2_016_000 + 1e-12)


def test_reference_inputs_hold_from_their_start_on():
    reference = ReferenceInputs((Piece(0, Inputs(1.0, 0.0)), Piece(10, Inputs(2.0, 0.0))))

    assert [reference.at(t).v_mps for t in (0, 9, 10, 11)] == [1.0, 1.0, 2.0, 2.0]
    assert reference.changes_ns == (10,)


@pytest.mark.parametrize(("make", "said"), [
    (lambda: ReferenceInputs(()), r"pieces start at \[\] ns"),
    (lambda: ReferenceInputs((Piece(5, Inputs(1.0, 1.0)),)), r"pieces start at \[5\] ns: expected 0, then later"),
    (lambda: ReferenceInputs((Piece(0, Inputs(1.0, 1.0)), Piece(0, Inputs(2.0, 1.0)))), "later and later instants"),
    (lambda: ReferenceInputs((Piece(0, Inputs(float("nan"), 1.0)),)), "expected finite numbers"),
    (lambda: noise(measured=-1.0), r"measured=-1\.0"), (lambda: noise(knot_ns=0), "knot_ns=0"),
    (lambda: made("individual_gains", lost=lambda k: True), r"lost\(0\): the first transmission must arrive"),
    (lambda: made("individual_gains", length_ns=0), "length_ns=0"),
])
def test_runs_that_cannot_be_are_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


def test_a_far_start_is_still_certified_and_only_slower():
    far = run(IndividualGains(SYSTEM, GAINS), REFERENCE, (0.0, 50.0, pi), SECOND, noise=noise())

    assert max(far.intervals_ns) < 17 * MS
    assert all(sent.t_ns <= before.decision.holds_until_ns for before, sent in pairwise(far.transmissions))
