"""What every policy does alike, and the adaptive one against Figure 3.3 taken instant by instant."""

from fractions import Fraction
from math import hypot
from random import Random

import pytest

from agents.pursuit.sampling.adaptive import Adaptive
from agents.pursuit.sampling.periodic import Periodic
from agents.pursuit.zones import Zones

STEP_NS = 70_000_000
ZONES = Zones(2.3, 1.15, 0.55)
V_MAX_MPS = 0.7
POLICIES = {"periodic": lambda: Periodic(STEP_NS, Fraction(786, 17)),
            "adaptive": lambda: Adaptive(STEP_NS, ZONES, V_MAX_MPS),
            "adaptive, late answers": lambda: Adaptive(STEP_NS, ZONES, V_MAX_MPS, 3 * STEP_NS)}


@pytest.fixture(params=POLICIES)
def policy(request):
    return POLICIES[request.param]()


def started(policy):
    """After the looks that a filter starts from."""
    for k in range(3):
        policy.asked(k * STEP_NS)
        policy.detected(k * STEP_NS, (0.1 * k, 0.0), False)
    return policy


def test_the_first_looks_are_at_consecutive_instants(policy):
    found = []
    for k in range(3):
        found.append(policy.next_look_ns(k * STEP_NS - 1, (0.0, 0.0)))
        policy.asked(k * STEP_NS)

    assert found == [0, STEP_NS, 2 * STEP_NS]


def test_looks_are_at_instants_after_now_and_never_come_nearer_while_nothing_is_seen(policy):
    started(policy)
    rng, now_ns, before_ns = Random(1), 2 * STEP_NS, 0

    for _ in range(300):
        look_ns = policy.next_look_ns(now_ns, (0.0, 0.0))

        assert look_ns % STEP_NS == 0
        assert look_ns > now_ns
        assert look_ns >= before_ns
        now_ns, before_ns = now_ns + rng.randrange(3 * STEP_NS), look_ns


@pytest.mark.parametrize("detections", [17, 22, 31, 100, 786])
def test_periodic_looks_are_those_of_the_tables(detections):
    policy = started(Periodic(STEP_NS, Fraction(786, detections)))
    now_ns, found = 2 * STEP_NS, []

    while now_ns < 785 * STEP_NS:
        now_ns = policy.next_look_ns(now_ns, (0.0, 0.0))
        found.append(now_ns // STEP_NS)

    expected = [i * 786 // detections for i in range(detections + 1)]
    assert [k for k in found if k < 786] == [k for k in expected if 2 < k < 786]


def figure_3_3(seen_k, seen, owns):
    """The instant to look at, by testing d(m) <= zeta at every instant m."""
    m = seen_k
    while True:
        own = owns(m)
        if 2.3 - hypot(seen[0] - own[0], seen[1] - own[1]) - V_MAX_MPS * (m - seen_k) * 0.07 <= 0.55:
            return m + 1
        m += 1


@pytest.mark.parametrize("every", [1, 2, 7, 100])
def test_the_adaptive_policy_looks_when_figure_3_3_does_however_rarely_it_is_asked(every):
    """Asked at least once one step before the instant that it named; the pursuer comes nearer to what it saw."""
    rng = Random(2)
    for _ in range(100):
        policy = started(Adaptive(STEP_NS, ZONES, V_MAX_MPS))
        seen = rng.uniform(-1.5, 1.5), rng.uniform(-1.5, 1.5)
        speed = rng.uniform(0.0, 0.3)

        def owns(m, seen=seen, speed=speed):
            return seen[0] * (1 - 0.97 ** (speed * m)), seen[1] * (1 - 0.97 ** (speed * m))

        policy.detected(2 * STEP_NS, seen, False)
        m = 2
        while True:
            look = policy.next_look_ns(m * STEP_NS, owns(m)) // STEP_NS
            if look == m + 1:
                break
            m = min(m + every, look - 1)

        assert look == figure_3_3(2, seen, owns)


def test_a_filter_that_is_off_looks_at_once_and_then_no_longer():
    policy = started(Adaptive(STEP_NS, ZONES, V_MAX_MPS))

    policy.detected(10 * STEP_NS, (0.0, 0.0), True)
    at_once = policy.next_look_ns(10 * STEP_NS, (0.0, 0.0))
    policy.detected(11 * STEP_NS, (0.0, 0.0), False)

    assert at_once == 11 * STEP_NS
    assert policy.next_look_ns(11 * STEP_NS, (0.0, 0.0)) > 30 * STEP_NS


def test_a_look_under_way_is_waited_for_and_then_asked_for_again():
    policy = started(Adaptive(STEP_NS, ZONES, V_MAX_MPS, 3 * STEP_NS))
    policy.detected(10 * STEP_NS, (0.0, 0.0), True)

    policy.asked(11 * STEP_NS)

    found = [policy.next_look_ns(k * STEP_NS, (0.0, 0.0)) // STEP_NS for k in (11, 12, 14, 15, 16)]
    assert found == [15, 15, 15, 16, 17]


def test_a_pursuer_that_is_near_what_it_saw_may_wait_longer():
    policy = started(Adaptive(STEP_NS, ZONES, V_MAX_MPS))
    policy.detected(10 * STEP_NS, (1.2, 0.0), False)

    far, near = (policy.next_look_ns(10 * STEP_NS, own) for own in ((0.0, 0.0), (1.2, 0.0)))

    assert (near - far) * 1e-9 == pytest.approx(1.2 / V_MAX_MPS, abs=0.07)


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="period_steps=1/2"):
        Periodic(STEP_NS, Fraction(1, 2))
    with pytest.raises(ValueError, match="step_ns=0"):
        Periodic(0, 3)
    with pytest.raises(ValueError, match="v_max_mps=40"):
        Adaptive(STEP_NS, ZONES, 40.0)
    with pytest.raises(ValueError, match="latency_ns=-1"):
        Adaptive(STEP_NS, ZONES, V_MAX_MPS, -1)
