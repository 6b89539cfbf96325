"""The "ours" column of docs/reproduction.md, Chapter 4: computed here, row by row, so that the page cannot rot.

`pytest -s tests/agents/tracking/test_reproduction.py -k ratio` prints the row "ratio".
"""

from functools import cache
from math import hypot, pi, sqrt
from statistics import fmean

import numpy as np
import pytest
import scipy.optimize

from agents.tracking.closed_loop import run
from agents.tracking.controller import Inputs, TrackingController
from agents.tracking.error_bound import Bound, ErrorBound
from agents.tracking.error_dynamics import error_rate, y_tilde
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.noise import Noise
from agents.tracking.nominal_system import NominalTracking
from agents.tracking.predicted_error import PredictedError
from agents.tracking.section_4_6 import GAINS, LENGTH_NS, REFERENCE, REGIONAL, SMALLEST_GAIN_PER_S, START
from agents.triggering.error_gain import KAPPA, horizon_s, longest_horizon_s
from agents.triggering.gain_table import GainTable
from agents.triggering.l2_gain import estimate_gain
from agents.triggering.policies.input_output import IndividualGains
from agents.triggering.policies.table import PolicySettings, build_policy
from netem.core.random_streams import stream
from tests.agents.reproduction_page import documented

SECOND = 10**9
PIECES_S = {(1.0, 1.0): 2.26, (0.6, 0.15): 6.99, (2.0, 2.0): 2.75}


@cache
def made(name, bound=Bound.LEAST, losses=0, seed=1, measured=0.15, sample_ns=SECOND // 100, gains=GAINS):
    noise = Noise(stream(seed, "tracking/measuring"), stream(seed, "tracking/driving"), measured)
    policy = build_policy(name, TrackingErrorSystem(bound=bound), gains, PolicySettings(max_successive_losses=losses))
    return run(policy, REFERENCE, START, LENGTH_NS, noise=noise, sample_ns=sample_ns)


@cache
def predicted(tolerance, measured=0.15, inputs=0.3, seed=1):
    """The run of a controller that predicts the state between looks instead of holding the measurement."""
    noise = Noise(stream(seed, "tracking/measuring"), stream(seed, "tracking/driving"), measured, inputs)
    policy = PredictedError(tolerance, measured, inputs)
    return run(policy, REFERENCE, START, LENGTH_NS, noise=noise, predict_ns=SECOND // 100)


def largest_held_error():
    """The largest |x^ - x| of the run that holds measurements, sampled every ms."""
    return max(hypot(*sample.e) for sample in made("individual_gains", sample_ns=SECOND // 1000).samples)


def last_rms(runs):
    return f"{fmean(each.rms(10 * SECOND, 12 * SECOND) for each in runs):.3f}"


def error_rms(of):
    return sqrt(fmean(hypot(*sample.e) ** 2 for sample in of.samples))


def transmissions(name, bound=Bound.LEAST, losses=0):
    return str(len(made(name, bound, losses).transmissions))


EVERYWHERE = GainTable({inputs: row.gain_per_s for inputs, row in REGIONAL.items()}, GAINS.unified)


def with_regional_gains_everywhere(name):
    return str(len(made(name, gains=EVERYWHERE).transmissions))


def gain_of_norm_1(*held):
    found = estimate_gain(NominalTracking(Inputs(*held)), 1.0, 10.0, steps=100, iterations=60)
    return f"{found.lower_estimate:.2f}"


def left_by_delays(*delays_ms):
    decided = build_policy("individual_gains", TrackingErrorSystem(), GAINS).decide(0, (0.0, 0.0, 0.0), Inputs(1, 1))
    return ", ".join(f"{decided.valid_ns / 1e6 - delay_ms:.2f}" for delay_ms in delays_ms) + " ms"


def intervals(taus_ns):
    return f"{min(taus_ns) / 1e6:.1f} to {max(taus_ns) / 1e6:.1f} ms"


def both(bound):
    return f"{transmissions('individual_gains', bound)} / {transmissions('unified_gain', bound)}"


def small_signal_gain(*held):
    found = estimate_gain(NominalTracking(Inputs(*held)), 0.01, 10.0, steps=100, iterations=30, tolerance=2e-4)
    return f"{found.lower_estimate:.3g}"


def lower_bound(gains):
    return f"{sum(length_s * gain / KAPPA for length_s, gain in zip(PIECES_S.values(), gains, strict=True)):.1f}"


def growth(name, gains, printed):
    """Mean ||A|| of our run, and the one that would give the printed number of transmissions."""
    def excess(a):
        return sum(s / horizon_s(a, gain) for s, gain in zip(PIECES_S.values(), gains, strict=True)) - printed

    needed = scipy.optimize.brentq(excess, 0.1, 500)
    ours = fmean(sent.decision.growth_per_s for sent in made(name).transmissions)
    return f"{ours:.1f}, {needed:.0f} 1/s"


def violation_of_the_printed_matrix():
    controller, x, e, held, nothing = (TrackingController(), (0.0, 0.1, pi / 2 - 0.5), (0.0, 0.0, 1.0),
                                       Inputs(1.0, 0.0), Inputs(0.0, 0.0))
    A = np.array(ErrorBound(controller, Bound.PRINTED).matrix(1.0, tuple(map(abs, x))))
    bound = A @ np.abs(e) + y_tilde(controller, x, held, nothing)
    rate = error_rate(controller, x, e, held, nothing)
    return f"{abs(rate[0]):.4f} > {bound[0]:.4f}"


INDIVIDUAL = [GAINS.gain(inputs) for inputs in PIECES_S]
UNIFIED = [GAINS.unified] * 3
# More than 1.5 s each: gains by simulations of 10 s, watched regions.
SLOW = {"gain-1-1", "gain-2-2", "gain-3-3", "regional-0.6-0.15", "regional-2-2", "regional-event"}

ROWS = {
    "gain-0.6-0.15": lambda: small_signal_gain(0.6, 0.15),
    "gain-1-1": lambda: small_signal_gain(1.0, 1.0),
    "gain-2-2": lambda: small_signal_gain(2.0, 2.0),
    "gain-3-3": lambda: small_signal_gain(3.0, 3.0),
    "individual": lambda: transmissions("individual_gains"),
    "unified": lambda: transmissions("unified_gain"),
    "ratio": lambda: f"{int(transmissions('unified_gain')) / int(transmissions('individual_gains')):.2f}",
    "lower-individual": lambda: lower_bound(INDIVIDUAL),
    "lower-unified": lambda: lower_bound(UNIFIED),
    "growth-individual": lambda: growth("individual_gains", INDIVIDUAL, 580),
    "growth-unified": lambda: growth("unified_gain", UNIFIED, 1377),
    "intervals": lambda: intervals(made("individual_gains").intervals_ns),
    "rms": lambda: f"{made('individual_gains').rms(10 * SECOND, 12 * SECOND):.3f}",
    "matrix": violation_of_the_printed_matrix,
    "closed-form": lambda: both(Bound.CLOSED_FORM),
    "logarithmic": lambda: both(Bound.LOGARITHMIC_NORM),
    "event-triggered": lambda: transmissions("event_triggered"),
    "regional-0.6-0.15": lambda: gain_of_norm_1(0.6, 0.15),
    "regional-1-1": lambda: gain_of_norm_1(1.0, 1.0),
    "regional-2-2": lambda: gain_of_norm_1(2.0, 2.0),
    "regional": lambda: with_regional_gains_everywhere("individual_gains"),
    "regional-event": lambda: with_regional_gains_everywhere("event_triggered"),
    "regional-watched": lambda: transmissions("regional_gains"),
    "delays": lambda: left_by_delays(5, 10, 17, 19),
    "periodic": lambda: transmissions("periodic"),
    "one-loss": lambda: transmissions("individual_gains", losses=1),
    "zeno": lambda: f"{IndividualGains(TrackingErrorSystem(), GAINS).shortest_s(10.0) * 1e3:.2f} ms",
    "longest": lambda: f"{longest_horizon_s(SMALLEST_GAIN_PER_S) * 1e3:.0f} ms",
    "largest-error": lambda: f"{largest_held_error():.3f}",
    "predicted": lambda: str(len(predicted(round(largest_held_error(), 3)).transmissions)),
    "predicted-intervals": lambda: intervals(predicted(round(largest_held_error(), 3)).intervals_ns),
    "predicted-rms": lambda: " / ".join((last_rms(made("individual_gains", seed=seed) for seed in range(1, 9)),
                                         last_rms(predicted(0.399, seed=seed) for seed in range(1, 9)))),
    "predicted-without-nu": lambda: ", ".join(
        f"{len(each.transmissions)} with {error_rms(each):.4f}"
        for each in (made("individual_gains", measured=0.0), predicted(0.1, 0.0))),
    "predicted-ideal": lambda: str(len(predicted(1e-3, 0.0, 0.0).transmissions)),
    "detectable": lambda: f"{1 / (TrackingController().k2_per_m2 * sqrt(2)):.3f} m/s",
}


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in ROWS])
def test_the_page_says_what_the_code_gives(name):
    ours = ROWS[name]()
    print(f"{name}: {ours}")

    assert documented("Chapter 4")[name] == ours


def test_the_page_has_no_row_that_is_not_computed():
    assert set(documented("Chapter 4")) == set(ROWS)
