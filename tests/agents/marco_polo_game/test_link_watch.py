"""Which links a pursuing UGV takes for lost: at the bounds of what it can know."""

from __future__ import annotations

import pytest

from agents.marco_polo_game.link_watch import LinkWatch
from agents.marco_polo_game.track import Seen

S, MS = 1_000_000_000, 1_000_000
AT_NS = 10 * S
PLACES = {"uav": (5.0, 5.0)}


def watch(since_ns: int = 0, margin_m: float = 0.0) -> LinkWatch:
    """Of a view of 1.5 m around (5, 5), a target of at most 0.7 m/s, looks 100 ms apart, 300 ms to be told."""
    return LinkWatch("ugv", "target", ("radio", "view_ugv", "grip"), {"uav": 1.5, "ugv": 1.0}, 0.7, margin_m, 100 * MS,
                     300 * MS, since_ns)


@pytest.mark.parametrize(("after_ms", "x", "lost"), [
    (399, 5.0, False),          # of the exposure at 100 ms it has to hear by 400 ms
    (400, 5.0, True),
    (10_000, 6.43, True),       # 0.07 m from the boundary it is in view for 100 ms
    (10_000, 6.44, False),      # 0.06 m from it, it may be out of view at the next exposure
])
def test_a_sensor_that_sees_the_target_and_does_not_tell_is_a_lost_link(after_ms: int, x: float, lost: bool) -> None:
    found = watch().lost({"uav": Seen(AT_NS, (x, 5.0))}, PLACES, AT_NS + after_ms * MS)

    assert found == (["radio: uav -> ugv"] if lost else [])


def test_sensors_that_drive_or_never_saw_it_are_not_judged() -> None:
    seen = {"uav": Seen(AT_NS, (5.0, 5.0)), "ugv": Seen(AT_NS, (5.0, 5.0))}

    assert watch().lost(seen, {}, AT_NS + S) == []
    assert watch().lost({}, PLACES, AT_NS + S) == []
    assert watch().lost(seen, {"ugv": (5.0, 5.0)}, AT_NS + S) == []


def test_sights_from_before_the_pursuit_need_not_be_told() -> None:
    seen = {"uav": Seen(AT_NS, (5.0, 5.0))}

    assert watch(since_ns=AT_NS + 5 * S).lost(seen, PLACES, AT_NS + 10 * S) == []      # in view for 2.1 s
    assert watch(since_ns=AT_NS + 2 * S).lost(seen, PLACES, AT_NS + 10 * S) == ["radio: uav -> ugv"]


def test_noise_shortens_the_time_for_which_the_target_is_surely_in_view() -> None:
    seen = {"uav": Seen(AT_NS, (6.3, 5.0))}             # 0.2 m from the boundary

    assert watch(margin_m=0.1).lost(seen, PLACES, AT_NS + S) == ["radio: uav -> ugv"]
    assert watch(margin_m=0.2).lost(seen, PLACES, AT_NS + S) == []


def test_looks_without_an_answer_and_grips_without_one_are_lost_links_until_one_comes() -> None:
    links = watch()

    links.look(answered=False, within_capture=False)
    assert links.lost({}, {}, AT_NS) == ["view_ugv: target -> ugv"]
    links.look(answered=True, within_capture=True)
    assert links.lost({}, {}, AT_NS) == ["grip: ugv -> target"]
    links.look(answered=True, within_capture=False)
    assert links.lost({}, {}, AT_NS) == []
