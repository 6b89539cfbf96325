"""When a robot reports that its slot clock is out of step, in step again, or does not settle."""

from __future__ import annotations

from math import ceil, log

from agents.synchronization.in_step import InStep
from firmware_sim.slot_sync import Correction, SlotSync

FAR_NS = 40_000


def kinds(watch: InStep, *rounds: list[int]) -> list[list[str]]:
    return [[kind for kind, _, _ in watch.close_round(errors)] for errors in rounds]


def test_a_clock_that_is_stepped_is_reported_once_and_again_when_it_is_back():
    watch = InStep(FAR_NS, 0.5)

    assert kinds(watch, [10], [20_000_000, 0], [5_000_000], [], [30_000], [10]) == [
        [], ["clock out of step"], [], [], ["clock in step again"], []]


def test_a_clock_that_does_not_settle_in_twice_the_rounds_of_the_iteration_is_reported():
    watch = InStep(FAR_NS, 0.5)
    allowed = 2 * ceil(log(20_000_000 / FAR_NS) / log(2))

    told = kinds(watch, *([20_000_000] for _ in range(3 * allowed)))
    assert [place for place, found in enumerate(told) if found] == [0, allowed]
    assert told[allowed] == ["clock does not settle"]


def test_nobody_heard_is_no_sign_of_being_in_step():
    watch = InStep(FAR_NS, 0.5)

    assert kinds(watch, [20_000_000], *([] for _ in range(30)))[1:].count(["clock does not settle"]) == 1


def test_a_step_has_no_bound_from_far_on():
    sync = SlotSync(bound_ns=10_000, gain=0.5, rate_gain=0.1, far_ns=FAR_NS)

    for error_ns, correction in ((FAR_NS - 1, Correction(-10_000, 0.0)), (FAR_NS, Correction(-20_000, 0.0)),
                                 (-20_000_000, Correction(10_000_000, 0.0))):
        sync.heard("other", 0, error_ns, 0)
        assert sync.close_round(1_000_000) == correction
