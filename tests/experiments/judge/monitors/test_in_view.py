"""In view of at least one observer: by hand, against brute force, and in emulated runs with known motions."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import cos, inf, pi, radians, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from experiments.judge.monitors.in_view import InView
from experiments.judge.monitors.outcome import Finding
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.view_boundary import distance_m
from experiments.judge.run_data import load_run
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from netem.media.sensing.field_of_view import FieldOfView
from netem.media.sensing.settings import SensingSettings
from netem.media.sensing.sight import Body
from netem.records.signal_table import SignalTable
from tests.examples import examples
from tests.experiments.judge.monitors.test_link_and_sender_monitors import Copy, records

SIGHT, OTHER = ("view", "evader", "eye"), ("wide", "evader", "owl")
Floats = NDArray[np.float64]


def table(node: str, time_ns: Sequence[int], xs: Sequence[float], ys: Sequence[float] | None = None) -> SignalTable:
    values = np.column_stack([xs, ys if ys is not None else np.zeros(len(xs)), np.zeros(len(xs))])
    return SignalTable(node, ("x", "y", "theta"), ("m", "m", "rad"), np.array(time_ns, dtype=np.int64), values)


def sight(*, copies: Sequence[Copy] = (), length: int, evader: SignalTable, robot: SignalTable | None = None,
          range_m: float = 2.0) -> Records:
    bodies = {"evader": ("x", "y", "theta")} | ({"robot": ("x", "y", "theta")} if robot else {})
    cameras = {"eye": "robot"} if robot else {}
    views = {"view": SensingSettings(10, 2, range_m=range_m, bodies=bodies, cameras=cameras),
             "wide": SensingSettings(10, 2, range_m=3 * range_m, bodies={"evader": ("x", "y", "theta")})}
    signals = {"evader": evader} | ({"robot": robot} if robot else {})
    return Records(length, records(copies, length).ledger, signals, (), views)


def stretches(finding: Finding) -> list[tuple[str, int, int]]:
    return [(violation.on, violation.from_ns, violation.until_ns) for violation in finding.violations]


# --- the distance to the boundary

@pytest.mark.parametrize("half_angle_deg", [20.0, 60.0, 90.0, 130.0, 179.0, 180.0])
def test_the_distance_is_that_to_the_nearest_of_many_points_of_the_boundary(half_angle_deg: float) -> None:
    view = FieldOfView(2.0, half_angle_deg)
    half, parts = radians(half_angle_deg), 4000
    rim = [(2 * cos(a), 2 * sin(a)) for a in np.linspace(-half, half, parts)]
    sides = [(r * cos(side), r * sin(side)) for side in (-half, half) for r in np.linspace(0, 2, parts)]
    boundary = np.array(rim + (sides if half_angle_deg < 180 else []))
    rng = np.random.default_rng(3)
    for _ in range(60):
        heading, cx, cy = rng.uniform(-20, 20, 3)
        px, py = rng.uniform(-3.5, 3.5, 2)          # in the camera's frame
        x, y = cx + px * cos(heading) - py * sin(heading), cy + px * sin(heading) + py * cos(heading)

        found = distance_m(view, tuple(np.array([v]) for v in (cx, cy, heading)), (np.array([x]), np.array([y])))[0]

        nearest = np.hypot(boundary[:, 0] - px, boundary[:, 1] - py).min()
        assert abs(abs(found) - nearest) < 2 * pi * 2 / parts        # the boundary's points lie so far apart
        fate = view.fate(Body(cx, cy, 0.0, heading), Body(x, y, 0.0, 0.0))
        assert (found >= 0) == (fate is None) or abs(found) < 1e-12


def test_without_a_range_only_the_sides_are_a_boundary() -> None:
    view = FieldOfView(inf, 45.0)
    origin = tuple(np.zeros(3) for _ in range(3))

    found = distance_m(view, origin, (np.array([2.0, 0.0, -3.0]), np.array([0.0, 2.0, 0.0])))

    assert found == pytest.approx([2 * sin(pi / 4), -2 * sin(pi / 4), -3.0], rel=1e-12)


# --- violations, by hand

def test_it_is_violated_from_the_sample_at_which_it_is_out_until_one_at_which_it_is_back() -> None:
    run_out = sight(length=60, evader=table("evader", [0, 10, 20, 30, 40, 50], [1.0, 2.0, 2.1, 2.4, 1.9, 1.0]))

    found = InView().watch([SIGHT], run_out)

    assert stretches(found) == [("evader in view of eye", 20, 40)]
    assert (found.worst, found.margin) == (pytest.approx(-0.4), pytest.approx(-0.4))
    assert found.violations[0].worst == pytest.approx(-0.4)
    assert found.violations[0].node == "evader"


def test_the_camera_moves_with_the_body_that_carries_it() -> None:
    away = [0.0, 1.0, 2.0, 3.0]
    chased = sight(length=40, evader=table("evader", [0, 10, 20, 30], away),
                   robot=table("robot", [0, 10, 20, 30], [0.0, 0.5, 1.5, 2.5]))

    found = InView().watch([SIGHT], chased)

    assert (found.violations, found.margin) == ([], pytest.approx(1.5))


def test_one_observer_that_has_it_in_view_is_enough() -> None:
    out = sight(length=30, evader=table("evader", [0, 10, 20], [1.0, 4.0, 7.0]))

    found = InView().watch([SIGHT, OTHER], out)

    assert stretches(found) == [("evader in view of eye or owl", 20, 30)]
    assert found.worst == pytest.approx(-1.0)


def test_one_sample_is_enough_to_judge_by() -> None:
    found = InView(closing_speed_mps=1e6).watch([SIGHT], sight(length=30, evader=table("evader", [0], [1.5])))

    assert (found.violations, found.worst) == ([], pytest.approx(0.5 - 0.03))


def test_nobody_can_say_what_was_never_sampled() -> None:
    assert not InView().watch([SIGHT], sight(length=30, evader=table("evader", [], []))).judged
    assert not InView().watch([SIGHT], Records(30, records([], 30).ledger, {}, (), sight(
        length=30, evader=table("evader", [], [])).sights)).judged


# --- between samples

@given(st.lists(st.floats(-1, 1), min_size=12, max_size=120), st.integers(2, 12))
@settings(max_examples=examples(60), deadline=None)
def test_between_samples_it_is_never_nearer_than_said_and_can_be_as_near(speeds: list[float], every: int) -> None:
    """Motion along x at up to 1 m/s, known at every nanosecond, 1 m/s being 0.01 m a nanosecond here."""
    v = 1e7                                                 # [m/s], 0.01 m in a nanosecond
    xs = 1.0 + np.r_[0.0, np.cumsum(speeds)] * 0.01
    seen = np.arange(0, xs.size, every)
    watched = sight(length=int(seen[-1]) + 1, evader=table("evader", seen.tolist(), xs[seen].tolist()))

    found = InView(closing_speed_mps=v).watch([SIGHT], watched)

    true = 2.0 - np.abs(xs[:seen[-1] + 1])
    assert found.worst is not None
    assert found.worst <= true.min() + 1e-9
    extreme = min([2.0 - abs(xs[seen[-1]]) - 0.01, *(
        (4.0 - abs(xs[a]) - abs(xs[b]) - 0.01 * every) / 2 for a, b in pairwise(seen))])
    assert found.worst == pytest.approx(extreme, abs=1e-9)          # towards the boundary at full speed, and back
    assert not [violation for violation in found.violations if "closing_speed" in violation.cause]


def test_what_may_have_been_out_between_two_samples_is_violated_from_the_first() -> None:
    near = sight(length=20, evader=table("evader", [0, 10], [1.99, 1.99]))

    assert InView().watch([SIGHT], near).violations == []
    assert stretches(InView(closing_speed_mps=3e6).watch([SIGHT], near)) == [("evader in view of eye", 0, 20)]


def test_samples_that_move_faster_than_stated_prove_nothing_and_say_so() -> None:
    jump = sight(length=1_000_000_000, evader=table("evader", [0, 500_000_000], [0.0, 1.0]))

    violation, = InView(closing_speed_mps=1.5).watch([SIGHT], jump).violations

    assert (violation.from_ns, violation.until_ns, violation.worst) == (0, 500_000_000, None)
    assert violation.cause.startswith("its distance to the boundary changes by up to 2 m/s, so that nothing is known")


def test_a_speed_that_is_none_is_refused() -> None:
    for speed in (0.0, -1.0, inf, float("nan")):
        with pytest.raises(ValueError, match="closing_speed_mps="):
            InView(closing_speed_mps=speed)


# --- causes

def test_the_cause_names_the_last_look_and_what_was_lost_late_or_slow_since_it_was_well_in_view() -> None:
    radio = ("radio", "base", "robot")
    copies = [Copy(0, 10, delivered=12, end=10, link=SIGHT), Copy(1, 20, "lost", end=20, link=SIGHT,
                   cause="impairments[0] x"),
              Copy(2, 30, delivered=55, end=30, link=SIGHT), Copy(0, 15, delivered=28, end=16, link=radio),
              Copy(0, 20, "lost", end=20, link=("view", "bystander", "eye")), Copy(1, 5, "lost", end=6, link=radio),
              Copy(3, 36, "out of view", end=36, link=SIGHT)]
    lost = sight(copies=copies, length=60, evader=table("evader", range(0, 60, 10), [0, 1.0, 1.5, 1.9, 2.5, 2.5]),
                 robot=table("robot", range(0, 60, 10), [0.0] * 6))

    violation, = InView().watch([SIGHT], lost).violations

    assert violation.cause == (
        "eye saw it last at 0.00000001 s, told at 0.000000012 s; since 0.00000001 s "
        "view: evader -> eye: frame 1 lost (impairments[0] x), frame 2 on its way until 0.000000055 s, "
        "slowest 0.000000013 s (radio: base -> robot)")


def test_the_cause_also_names_what_modems_on_a_line_of_the_observer_or_its_carrier_lost() -> None:
    air, up = ("air", "modem", "far_modem"), ("line", "eye", "modem")
    copies = [Copy(0, 5, delivered=7, end=5, link=SIGHT), Copy(0, 12, delivered=13, end=13, link=up),
              Copy(0, 14, "lost", end=15, link=air, cause="impairments[0] x"),
              Copy(0, 15, "lost", end=16, link=("other", "stranger", "another"))]
    lost = sight(copies=copies, length=40, evader=table("evader", range(0, 40, 10), [0, 1.0, 2.5, 2.5]),
                 robot=table("robot", range(0, 40, 10), [0.0] * 4))

    violation, = InView().watch([SIGHT], lost).violations

    assert "air: modem -> far_modem: frame 0 lost (impairments[0] x)" in violation.cause
    assert "stranger" not in violation.cause


def test_of_one_that_was_never_seen_nothing_is_known() -> None:
    violation, = InView().watch([SIGHT], sight(length=20, evader=table("evader", [0, 10], [3.0, 3.0]))).violations

    assert violation.cause == "eye has never seen it; since 0 s nothing was lost or on its way"


# --- whole runs

ROBOTS = '''
from netem.media.sensing.sight import LOOK


class Driver:
    """Shows where it is, and drives as it is."""

    def __init__(self, board):
        names, units = ("x", "y", "theta"), ("m", "m", "rad")
        board.record_all(list(zip(names, units)), board.sensors(names, units).read)

    def run(self):
        return
        yield


class Shy(Driver):
    def __init__(self, board):
        pass


class Eye:
    def __init__(self, board):
        self.board, self.port = board, board.port("view")
        self.port.on_receive = lambda data: None

    def run(self):
        for k in range(40):
            yield from self.board.sleep_until(k * 100_000_000)
            self.port.send(LOOK)
'''
SCENARIO = '''# A camera watches a robot that leaves on a straight line.
# Question: when is it gone?
seed = 1
length_s = 4.0
team.reference = { from_s = [0.0], v_mps = [1.0], omega_radps = [0.0] }
[agents.evader]
program = "robots_in_view:Driver"
plant = { fmu = "virtual_reference", parameters_from = "team.reference" }
[agents.eye]
program = "robots_in_view:Eye"
[media.view]
kind = "sensing"
exposure_period_ms = 100
latency_ms = 20
range_m = 2.505
bodies = { evader = ["x", "y", "theta"] }
[media.air]
kind = "broadcast_radio"
preset = "crazyflie_p2p"
[[impairments]]
on = "view: evader -> eye"
kind = "scripted_loss"
lose_frames = [23, 24]
[guarantees.no_escape]
kind = "in_view"
on = "view: evader -> eye"
closing_speed_mps = 1.0
expected = "violated"
'''


@pytest.fixture
def leave(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "robots_in_view.py").write_text(ROBOTS, encoding="utf-8")
    (tmp_path / "leave.toml").write_text(SCENARIO, encoding="utf-8")
    yield tmp_path / "leave.toml"
    sys.modules.pop("robots_in_view", None)


@pytest.mark.parametrize("host", ["inline", "process"])
def test_the_instant_is_that_of_the_boundary_and_the_cause_names_the_impairment(
        leave: Path, tmp_path: Path, host: HostName) -> None:
    result = run(load(leave), host=host, out=tmp_path / host, report=False)

    standing, = result.summary.guarantees
    assert standing.as_expected
    assert standing.first is not None
    assert standing.first.from_ns == 2_500_000_000          # at 1 m/s it is at 2.505 m between this sample and the next
    assert (standing.worst, standing.unit) == (pytest.approx(2.505 - 4.0, abs=1e-9), "m")
    assert standing.first.cause == (
        "eye saw it last at 2.2 s, told at 2.22 s; since 1.25 s view: evader -> eye: frames 23, 24 lost "
        "(impairments[0] scripted_loss), frame 25 on its way until 2.52 s, slowest 0.02 s (view: evader -> eye)")
    assert any(event.kind == "guarantee violated" and event.time_ns == 2_500_000_000
               for event in load_run(result.folder).events)


@pytest.mark.parametrize(("was", "now", "says"), [
    ('on = "view: evader -> eye"\nclosing', 'on = "air: evader -> eye"\nclosing',
     "no such pair of a body and its observer on a sensing medium at any time of the run; nearest: 'view: evader"),
    ('on = "view: evader -> eye"\nclosing', 'on = "view: eye -> evader"\nclosing', "no such pair of a body and its"),
    ("closing_speed_mps = 1.0", "closing_speed_mps = 0.0", "closing_speed_mps=0.0: expected more than 0"),
    ("length_s = 4.0", "length_s = 4.0\nsample_period_s = 0", "no signal is sampled while sample_period_s is 0"),
])
def test_mistakes_are_told_before_the_start(leave: Path, was: str, now: str, says: str) -> None:
    assert was in SCENARIO
    leave.write_text(SCENARIO.replace(was, now), encoding="utf-8")

    with pytest.raises(ScenarioError) as error:
        load(leave)

    assert says in str(error.value)


def test_a_body_whose_program_records_nothing_is_seen_by_the_outputs_of_its_plant(leave: Path, tmp_path: Path) -> None:
    told = run(load(leave), host="inline", out=tmp_path / "told", report=False).summary
    leave.write_text(SCENARIO.replace("robots_in_view:Driver", "robots_in_view:Shy"), encoding="utf-8")

    untold = run(load(leave), host="inline", out=tmp_path / "untold", report=False).summary

    assert [standing.first for standing in told.guarantees] != [None]
    assert untold.guarantees == told.guarantees
