from math import log

import pytest

from agents.triggering.assumptions import (
    Assumption,
    announcement_violations,
    input_violations,
    radius_violations,
    spacing_violations,
    violations,
)
from agents.triggering.gain_table import GainTable
from agents.triggering.policies import Decision

MS = 1_000_000
TAU_S = log(0.999 * 4 / 50 + 1) / 4                 # (4.37) retyped
IN_FORCE = Decision(100 * MS, 6 * MS, int(TAU_S * 1e9), 50.0, 4.0)


def names(found):
    return [violation.assumption for violation in found]


def test_until_its_end_a_decision_rests_on_nothing_broken():
    for now_ns in (0, IN_FORCE.measured_ns, IN_FORCE.next_ns, IN_FORCE.holds_until_ns):
        assert violations(IN_FORCE, now_ns) == []


def test_an_age_above_tau_is_named_with_the_instant_at_which_it_happened():
    (stale,) = violations(IN_FORCE, IN_FORCE.holds_until_ns + 1)

    assert stale.assumption is Assumption.FRESH
    assert stale.at_ns == IN_FORCE.holds_until_ns
    assert stale.value > stale.limit == pytest.approx(TAU_S, abs=1e-9)
    assert str(stale).startswith("age of information: the measurement in force is 0.019221742 s old, "
                                 "certified for 0.019221741 s")


def test_the_small_gain_condition_fails_a_little_later_when_kappa_is_spent():
    reached_ns = IN_FORCE.measured_ns + int(log(4 / 50 + 1) / 4 * 1e9)      # gamma_n gamma_e = 1

    assert names(violations(IN_FORCE, reached_ns - 10)) == [Assumption.FRESH]
    fresh, small_gain = violations(IN_FORCE, reached_ns + 10)
    assert (fresh.assumption, small_gain.assumption) == (Assumption.FRESH, Assumption.SMALL_GAIN)
    assert small_gain.at_ns == pytest.approx(reached_ns, abs=1)
    assert small_gain.value >= 1.0 == small_gain.limit


def test_one_more_loss_than_fits_is_named_when_it_happens_not_when_the_time_is_up():
    assert IN_FORCE.losses_allowed == 2
    at_ns = IN_FORCE.attempt_ns(2)

    (lost,) = violations(IN_FORCE, at_ns, failed_attempts=3)

    assert violations(IN_FORCE, at_ns, failed_attempts=2) == []
    assert (lost.assumption, lost.at_ns, lost.value, lost.limit) == (Assumption.LOSSES, at_ns, 3, 2)


def test_after_an_hour_of_silence_the_answer_is_still_two_names():
    assert names(violations(IN_FORCE, 3600 * 10**9)) == [Assumption.FRESH, Assumption.SMALL_GAIN]


def test_measurements_closer_than_the_zeno_bound_are_named():
    (close,) = spacing_violations(19 * MS, 10 * MS, 9 * MS + 1)

    assert spacing_violations(19 * MS, 10 * MS, 9 * MS) == []
    assert (close.assumption, close.at_ns) == (Assumption.SPACING, 19 * MS)


@pytest.mark.parametrize(("inputs", "assumption"), [
    ((1.0, 1.0), None), ((2.9, -3.0), Assumption.GAIN), ((3.1, 0.0), Assumption.INPUTS),
    ((0.0, -3.01), Assumption.INPUTS), ((float("nan"), 0.0), Assumption.INPUTS),
    ((0.0, float("inf")), Assumption.INPUTS)])
def test_inputs_outside_p_and_inputs_without_a_gain_are_named(inputs, assumption):
    found = input_violations(7, inputs, (3.0, 3.0), GainTable({(1.0, 1.0): 53.0}, 96.0))

    assert names(found) == ([] if assumption is None else [assumption])


def test_inputs_that_change_without_a_word_are_named_with_both_values():
    assert announcement_violations(7, (1.0, 1.0), (1.0, 1.0)) == []
    (changed,) = announcement_violations(7, (0.6, 0.15), (0.6, 1.0))

    assert (changed.assumption, changed.at_ns, changed.value) == (Assumption.ANNOUNCED, 7, 0.85)
    assert changed.text == "(0.6, 1) became (0.6, 0.15) unannounced, since the measurement before"


def test_a_state_outside_the_certified_radius_is_named_beyond_doubt_only():
    assert radius_violations(7, (3.0, 4.0, 0.0), 5.0) == []
    assert radius_violations(7, (3.0, 4.05, 0.0), 5.0, noise=0.15) == []
    (far,) = radius_violations(7, (3.0, 4.4, 0.0), 5.0, noise=0.15)
    assert far.assumption is Assumption.RADIUS
    assert far.value > far.limit
