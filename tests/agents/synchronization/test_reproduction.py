"""The "ours" column of docs/reproduction.md, Chapter 6: computed here, row by row, so that the page cannot rot.

`pytest -s tests/agents/synchronization/test_reproduction.py -k tau1` prints the row "tau1".
"""


import numpy as np
import pytest

from agents.synchronization.delayed_loop import DelayedLoop, Delays
from agents.synchronization.dwell_time import common_certificate, dwell_certificate, round_maps
from agents.synchronization.exact_loop import ExactLoop, Hearing, spectral_radius, stability_limit
from agents.synchronization.gains import a_star, l2_gain
from agents.synchronization.graph import edges
from agents.synchronization.partition import partition
from agents.synchronization.round_plan import plan_round
from agents.synchronization.slot_dwell import slot_dwell_certificate
from agents.synchronization.slot_length import Bound, small_gain_tau_s
from agents.synchronization.starving import signal_map, starving_signal
from tests.agents.reproduction_page import documented
from tests.agents.synchronization.exact_run import alternating, simulate

HALF_S = 500_000_000


class Example:
    """Section 6.5 with both topologies; every property is the text of one row's "ours"."""

    def __init__(self, agents, loops):
        self.agents, self.loops = agents, loops
        self.plans = [plan_round(agents, loop.laplacian) for loop in loops]

    def eigenvalue(self, k):
        return f"{self.loops[k].rightmost_eigenvalue.real:.6f}"

    def gamma(self, k):
        return f"{l2_gain(self.loops[k]).lower:.3f}"

    def a1_star(self):
        return "; ".join(" ".join(f"{entry:.0f}" for entry in row) for row in a_star(self.loops[0]))

    def parts(self, k):
        return "".join("{" + ",".join(str(agent + 1) for agent in part) + "}"
                       for part in partition(self.loops[k].laplacian))

    def tau(self, k, bound=Bound.PRINTED):
        return f"{small_gain_tau_s(self.loops[k], 3, bound):.5e} s"

    def slot(self, k):
        return f"{self.plans[k].slot_ns} ns"

    def broadcasts(self, k, bound=Bound.PRINTED):
        return f"{1 / (3 * small_gain_tau_s(self.loops[k], 3, bound)):.2f}"

    def exact(self, k):
        return ExactLoop(self.agents, self.plans[k].laplacian, self.plans[k].parts)

    def limit(self, k):
        return f"{stability_limit(self.exact(k), 1e-4, 0.02).stable_s:.5e} s"

    def radius(self, k):
        return f"{self.exact(k).spectral_radius(self.plans[k].slot_ns * 1e-9):.6f}"

    def delayed(self, k, slots, own_late):
        """Spectral radius of a round of slots tau' with every value of the others, and perhaps its own, slots late."""
        slot_ns = round(small_gain_tau_s(self.loops[k], 3) * 1e9)
        L, delay_ns = self.plans[k].laplacian, slots * slot_ns
        delays = Delays(dict.fromkeys(edges(L), delay_ns), (delay_ns if own_late else 0,) * len(L))
        return DelayedLoop(self.agents, L, slot_ns, delays).spectral_radius()

    def delayed_radii(self, k, own_late):
        return " ".join(f"{self.delayed(k, slots, own_late):.6f}" for slots in range(6))

    def most_slots(self, k, own_late):
        return f"{next(slots for slots in range(100) if self.delayed(k, slots + 1, own_late) >= 1)} slots"

    def certificate(self, hearing):
        found = common_certificate(round_maps(self.agents, self.plans, hearing))
        assert found.holds
        return f"{found.rate_per_s:.3f} 1/s"

    def dwell(self):
        found = dwell_certificate(round_maps(self.agents, self.plans))
        assert found.holds
        return f"{found.dwell_rounds} rounds"

    def dwell_of_slots(self, slots):
        found = slot_dwell_certificate(self.agents, self.plans, slots)
        assert found.holds
        return f"{found.rate_per_s:.3f} 1/s"

    def starved(self):
        return f"{spectral_radius(signal_map(self.agents, self.plans, starving_signal(self.plans, 4))):.5f}"

    def largest_output(self, at_s, disturbance=()):
        at_ns = round(at_s * 1e9)
        run = simulate(self.agents, self.plans, alternating(HALF_S), at_ns, [at_ns], disturbance=disturbance)
        return f"{np.abs(run.outputs[0]).max():.4f}"


OMEGA = ((0, 5.0), (4_400_000_000, -5.0), (8_800_000_000, 0.0))
ROWS = {
    "eigenvalue1": lambda e: e.eigenvalue(0),
    "eigenvalue2": lambda e: e.eigenvalue(1),
    "gamma1": lambda e: e.gamma(0),
    "gamma2": lambda e: e.gamma(1),
    "A1*": lambda e: e.a1_star(),
    "partition1": lambda e: e.parts(0),
    "partition2": lambda e: e.parts(1),
    "tau1": lambda e: e.tau(0),
    "tau2": lambda e: e.tau(1),
    "slot1": lambda e: e.slot(0),
    "slot2": lambda e: e.slot(1),
    "broadcasts1": lambda e: e.broadcasts(0),
    "broadcasts2": lambda e: e.broadcasts(1),
    "tau1-logarithmic": lambda e: e.tau(0, Bound.LOGARITHMIC_NORM),
    "tau2-logarithmic": lambda e: e.tau(1, Bound.LOGARITHMIC_NORM),
    "tau1-wirtinger": lambda e: e.tau(0, Bound.WIRTINGER),
    "tau2-wirtinger": lambda e: e.tau(1, Bound.WIRTINGER),
    "broadcasts1-wirtinger": lambda e: e.broadcasts(0, Bound.WIRTINGER),
    "broadcasts2-wirtinger": lambda e: e.broadcasts(1, Bound.WIRTINGER),
    "limit1": lambda e: e.limit(0),
    "limit2": lambda e: e.limit(1),
    "radius1": lambda e: e.radius(0),
    "radius2": lambda e: e.radius(1),
    "radii1-late": lambda e: e.delayed_radii(0, True),
    "radii1-at-once": lambda e: e.delayed_radii(0, False),
    "delay1-late": lambda e: e.most_slots(0, True),
    "delay1-at-once": lambda e: e.most_slots(0, False),
    "delay2-late": lambda e: e.most_slots(1, True),
    "delay2-at-once": lambda e: e.most_slots(1, False),
    "switching": lambda e: e.certificate(Hearing.NEIGHBOURS),
    "switching-everyone": lambda e: e.certificate(Hearing.EVERYONE),
    "dwell": lambda e: e.dwell(),
    "dwell-two-slots": lambda e: e.dwell_of_slots(2),
    "starving": lambda e: e.starved(),
    "quiet-end": lambda e: e.largest_output(13.0),
    "disturbed-middle": lambda e: e.largest_output(8.8, OMEGA),
    "disturbed-end": lambda e: e.largest_output(13.0, OMEGA),
}


# Seconds each: a search over three functions of 15 variables, and runs of 13 s.
SLOW = {"dwell-two-slots", "quiet-end", "disturbed-middle", "disturbed-end"}


@pytest.fixture(scope="module")
def example(five_agents, loop1, loop2):
    return Example(five_agents, (loop1, loop2))


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in ROWS])
def test_the_page_says_what_the_code_gives(name, example):
    ours = ROWS[name](example)
    print(f"{name}: {ours}")

    assert documented("Chapter 6")[name] == ours


def test_the_page_has_no_row_that_is_not_computed():
    assert set(documented("Chapter 6")) == set(ROWS)
