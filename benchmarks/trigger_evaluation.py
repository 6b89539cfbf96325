"""Measures one evaluation of the input-output trigger: command, reachable set, matrix A and tau (4.37) together.

    python -m benchmarks.trigger_evaluation [--rounds 40]

The inputs are the measurements of the 12 s run of section 4.6 (start, noise, inputs); the bounds take turns in one
process. Times are CPU times of this thread for one pass over all measurements, divided by their number: the median over
passes, and the same for the measurement at the start alone, far from the reference. The goal is 50 us.
"""

from __future__ import annotations

import argparse
import os
import statistics
from collections.abc import Sequence
from random import Random
from time import thread_time_ns

from agents.tracking.closed_loop import run
from agents.tracking.controller import Inputs, State
from agents.tracking.error_bound import Bound
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.noise import Noise
from agents.tracking.section_4_6 import GAINS, LENGTH_NS, REFERENCE, START
from agents.triggering.error_gain import largest_horizon
from agents.triggering.policies.input_output import IndividualGains, UnifiedGain

GOAL_US = 50
Trigger = IndividualGains[State, Inputs]
Measurement = tuple[State, Inputs]


def measurements() -> list[Measurement]:
    policy: Trigger = IndividualGains(TrackingErrorSystem(), GAINS)
    made = run(policy, REFERENCE, START, LENGTH_NS, noise=Noise(Random(1), Random(2)))
    return [(sent.measured, REFERENCE.at(sent.t_ns)) for sent in made.transmissions if sent.measured is not None]


def one_pass_us(policy: Trigger, points: Sequence[Measurement]) -> float:
    decide = policy.decide
    begin = thread_time_ns()
    for x, inputs in points:
        decide(0, x, inputs)
    return (thread_time_ns() - begin) / 1e3 / len(points)


def reaches(policy: Trigger, points: Sequence[Measurement]) -> float:
    """Mean number of reachable sets (with A and its norm) that one evaluation computes."""
    calls = 0
    for x, inputs in points:
        gain, prediction = policy.predict(x, inputs)

        def counted(tau_s: float, growth_until=prediction.growth_until) -> float:  # type: ignore[no-untyped-def]
            nonlocal calls
            calls += 1
            return float(growth_until(tau_s))

        largest_horizon(counted, gain, policy.kappa)
    return calls / len(points)


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of one evaluation of the input-output trigger.")
    parser.add_argument("--rounds", type=int, default=40, help="passes over the measurements of the 12 s run")
    rounds = max(1, parser.parse_args().rounds)
    points = measurements()
    start = points[:1] * len(points)
    policies: dict[str, Trigger] = {}
    for bound in Bound:
        policies[f"individual gains, {bound.value}"] = IndividualGains(TrackingErrorSystem(bound=bound), GAINS)
    policies["unified gain, least"] = UnifiedGain(TrackingErrorSystem(), GAINS)
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in policies}
    for _ in range(rounds):
        for name, policy in policies.items():
            times[name].append((one_pass_us(policy, points), one_pass_us(policy, start)))
    print(f"{'us per evaluation, CPU, median':<40} {'12 s run':>9} {'its start':>9} {'sets':>5}")
    for name, found in times.items():
        along, far = (statistics.median(column) for column in zip(*found, strict=True))
        print(f"  {name:<38} {along:9.1f} {far:9.1f} {reaches(policies[name], points):5.1f}")
    print(f"  goal: at most {GOAL_US} us; load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
