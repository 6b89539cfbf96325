"""Which links fail a pursuing UGV, at the bounds of what it can know."""

from __future__ import annotations

import pytest

from agents.marco_polo_game.link_watch import LinkWatch
from agents.marco_polo_game.track import Seen

S, MS = 1_000_000_000, 1_000_000
AT_NS = 10 * S
SEEN = {"uav": Seen(AT_NS, (5.0, 5.0))}


def watch(since_ns: int = 0) -> LinkWatch:
    return LinkWatch("ugv", "target", ("radio", "view_ugv", "grip"), 300 * MS, since_ns)


@pytest.mark.parametrize(("after_ms", "failed"), [(300, []), (301, ["radio: uav -> ugv"])])
def test_a_sensor_that_told_a_sight_and_then_nothing_is_a_lost_link(after_ms: int, failed: list[str]) -> None:
    links = watch()

    links.listen(SEEN, {}, ["uav"], AT_NS + after_ms * MS)

    assert links.failed == failed


@pytest.mark.parametrize(("out_ns", "failed"), [(AT_NS + 100 * MS, []), (AT_NS - 2 * S, ["radio: uav -> ugv"])])
def test_a_sensor_that_has_told_that_it_lost_sight_owes_no_more_news(out_ns: int, failed: list[str]) -> None:
    links = watch()

    links.listen(SEEN, {"uav": out_ns}, ["uav"], AT_NS + S)

    assert links.failed == failed


def test_sensors_that_pursue_or_never_saw_it_are_not_judged() -> None:
    links = watch()

    links.listen(SEEN, {}, [], AT_NS + S)
    links.listen({}, {}, ["uav"], AT_NS + S)

    assert links.failed == []


@pytest.mark.parametrize(("since_ns", "failed"), [(AT_NS, ["radio: uav -> ugv"]), (AT_NS + 1, [])])
def test_sights_from_before_the_target_is_pursued_are_not_followed_by_others(since_ns: int, failed: list[str]) -> None:
    links = watch(since_ns)

    links.listen(SEEN, {}, ["uav"], AT_NS + S)

    assert links.failed == failed


def test_links_that_failed_once_are_kept_in_order() -> None:
    links = watch()

    links.grip_failed()
    links.look_failed()
    links.grip_failed()
    links.listen({"uav": Seen(AT_NS + S, (5.0, 5.0))}, {}, ["uav"], AT_NS + S)

    assert links.failed == ["grip: ugv -> target", "view_ugv: target -> ugv"]
