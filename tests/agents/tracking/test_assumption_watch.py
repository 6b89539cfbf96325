"""What a robot says of its trigger's assumptions: once as one breaks, once as it holds again."""

from __future__ import annotations

import pytest

from agents.tracking.assumption_watch import IN_TIME, AssumptionWatch
from agents.triggering.assumptions import Assumption, Violation
from agents.triggering.policies.table import POLICIES


class Node:
    def __init__(self) -> None:
        self.said: list[tuple[str, str]] = []
        self.counted = 0

    def count(self, counter: str) -> None:
        assert counter == "violated assumptions"
        self.counted += 1

    def event(self, kind: str, detail: str) -> None:
        assert kind != "assumption violated"
        self.said.append((kind, detail))

    def warn(self, kind: str, detail: str) -> None:
        assert kind == "assumption violated"
        self.said.append((kind, detail))


def broken(assumption: Assumption, value: float = 2.0) -> Violation:
    return Violation(assumption, 7, value, 1.0, f"{value} of 1")


def test_an_assumption_that_stays_broken_is_told_once_and_again_after_it_held() -> None:
    watch = AssumptionWatch(node := Node(), "individual_gains")

    watch.fail([broken(Assumption.FRESH)])
    watch.fail([broken(Assumption.FRESH, 3.0)])
    watch.hold(IN_TIME)
    watch.hold(IN_TIME)
    watch.fail([broken(Assumption.FRESH, 4.0)])

    assert node.said == [("assumption violated", "age of information: 2.0 of 1"),
                         ("assumptions hold again", "age of information"),
                         ("assumption violated", "age of information: 4.0 of 1")]
    assert node.counted == 2


def test_a_small_gain_product_is_told_as_a_number_that_a_guarantee_can_read() -> None:
    watch = AssumptionWatch(node := Node(), "unified_gain")

    watch.fail([broken(Assumption.SMALL_GAIN, 1.25)])

    assert node.said[1] == ("gain product", "1.25: 1.25 of 1")


@pytest.mark.parametrize(("policy", "told"), [
    ("individual_gains", {Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.GAIN}),
    ("regional_gains", {Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.GAIN, Assumption.REGION}),
    ("unified_gain", {Assumption.INPUTS, Assumption.ANNOUNCED}),
    ("periodic", {Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.RADIUS})])
def test_a_measurement_is_judged_by_what_the_policy_assumes_alone(policy: str, told: set[Assumption]) -> None:
    assert policy in POLICIES
    shown = [broken(each) for each in (Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.GAIN, Assumption.RADIUS,
                                       Assumption.REGION)]
    watch = AssumptionWatch(node := Node(), policy)

    watch.judge(shown)
    watch.judge([])

    assert {detail.partition(":")[0] for kind, detail in node.said if kind == "assumption violated"} == {
        each.value for each in told}
    assert node.said[-1] == ("assumptions hold again", ", ".join(sorted(each.value for each in told)))


def test_late_information_stays_late_whatever_a_measurement_shows() -> None:
    watch = AssumptionWatch(node := Node(), "periodic")
    watch.fail([broken(Assumption.FRESH)])

    watch.judge([])

    assert [kind for kind, _ in node.said] == ["assumption violated"]
