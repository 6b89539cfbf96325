"""The board's program: its timing on its own clock, its silence, what it hears, what it records, its settings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import dist, pi
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_sim.autopilot.autopilot import NO_PLANT, Autopilot
from firmware_sim.autopilot.autopilot_settings import AutopilotSettings
from firmware_sim.autopilot.vehicle import Landed, Mode, Result
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.scenario_view import OwnAgent
from fmus.input_faults import InputFaults
from netem.media.sensing.sight import Detection, pack_detection, pack_nothing
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Grant
from tests.examples import examples

MS = 1_000_000
Bench = Callable[..., "FlightBench"]             # noqa: F821  (of conftest.py)


def seen(exposed_ns: int, name: str = "uav", x_m: float = 0.0) -> bytes:
    return pack_detection(Detection(exposed_ns, x_m, 0.0, 0.0, name))


class Noted(InputFaults):
    """No fault: it tells when inputs are written."""

    def __init__(self, tell: Callable[[], object]) -> None:
        self._tell = tell

    def of_values(self, names: tuple[str, ...], put: Callable[[Sequence[float]], object]) -> Any:
        def noted(values: Sequence[float]) -> object:
            self._tell()
            return put(values)
        return noted


def test_motors_change_an_execution_time_after_a_release_on_the_local_clock(bench: Bench) -> None:
    clock = ClockSettings(offset_ns=3 * MS + 250_000, drift_ppm=100.0, tick_ns=1000)
    uav = bench(clock=clock, period_ns=2 * MS, offset_ns=MS, execution_ns=700_000)
    uav.run(0.1)
    written: list[int] = []
    uav.autopilot._motors.let_change(Noted(lambda: written.append(uav.node.now_ns)))

    uav.controller.arm()
    uav.run(0.05)

    # local time is 103.26 ms after 100 ms: the next releases are at 105, 107, .. ms, and idling motors change at each
    assert written[:10] == [uav.clock.true_at((105 + 2 * k) * MS + 700_000) for k in range(10)]
    assert uav.counters.get("releases missed", 0) == 0


def test_it_promises_to_say_nothing_ever_and_what_it_hears_costs_no_grant(bench: Bench) -> None:
    uav = bench()
    report = uav.node.advance(Grant(0, 5 * MS, False, True, [(2 * MS, 0, seen(0))]))

    assert report.offers == []
    assert report.firm_ns >= NEVER_NS
    assert uav.node.hello().quiet == [0]


def test_a_drifting_clock_that_is_stepped_misses_releases_and_flies_on(bench: Bench) -> None:
    steps = ((9000 * MS, 45 * MS), (10_000 * MS, -30 * MS))
    uav = bench(clock=ClockSettings(offset_ns=70 * MS, drift_ppm=50.0), clock_steps=steps).flying()

    uav.run(7.0)

    assert uav.counters["releases missed"] in (44, 45)          # of 1 ms, stepped over by 45 ms
    assert uav.controller.state().mode is Mode.HOLD
    assert uav.ned() == pytest.approx((0.0, 0.0, -1.0), abs=0.02)


@pytest.mark.parametrize("step_ns", [3_000 * MS, -3_000 * MS])
def test_a_clock_that_is_set_by_seconds_is_no_loss_of_motion_capture(step_ns: int, bench: Bench) -> None:
    uav = bench(clock_steps=((8000 * MS, step_ns),), parameters={"LINK_LOSS_ACT": 0.0}).flying()
    errors: list[float] = []

    uav.run(8.0, lambda: errors.append(dist(uav.ned(), (0.0, 0.0, -1.0))))

    assert uav.controller.state().mode is Mode.HOLD
    assert max(errors) < 0.05
    assert uav.counters["motion capture taken"] > 1400
    if step_ns < 0:                 # the silence of a link is noticed although its last frame lies in the future
        uav.controller.parameters.set("LINK_LOSS_ACT", 1.0)
        uav.heard = False
        uav.run(2.5)
        assert uav.controller.state().failsafe == "link lost: hold"


def test_frames_are_counted_by_what_becomes_of_them(bench: Bench) -> None:
    uav = bench()
    uav.captured = False
    frames = [seen(10 * MS), seen(10 * MS), seen(5 * MS), seen(20 * MS, "rover"), pack_nothing(30 * MS), b"", b"D?",
              seen(25 * MS, x_m=float("nan")), seen(30 * MS)]
    for k, frame in enumerate(frames):
        uav.hears(40 * MS + k * MS, frame)

    uav.run(0.06)

    assert {key: count for key, count in uav.counters.items() if count} == {
        "motion capture taken": 2, "motion capture out of order": 2, "unreadable frames": 2,
        "motion capture refused": 1}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=examples(30), deadline=None)
@given(frames=st.lists(st.binary(max_size=60), max_size=6))
def test_no_bytes_from_the_medium_raise_or_arm(frames: list[bytes], bench: Bench) -> None:
    uav = bench()
    uav.captured = False
    for frame in frames:
        uav.hears(MS, frame)

    uav.run(0.02)

    assert not uav.controller.state().armed


def test_the_record_holds_truth_belief_and_what_was_meant(bench: Bench) -> None:
    uav = bench(sample_period_ns=10 * MS).flying()

    names = [name for name, _ in uav.node.hello().signals]
    last = dict(zip(names, uav.samples[-1][1], strict=True))

    assert last["z"] == pytest.approx(-last["est_down"], abs=0.005)
    assert last["z"] == pytest.approx(-last["ref_down"], abs=0.01)
    assert last["ref_yaw"] == pytest.approx(pi / 2, abs=0.01)       # faces the plant's x axis, east
    assert (last["armed"], last["mode"]) == (1.0, float(list(Mode).index(Mode.HOLD)))
    assert last["landed"] == float(list(Landed).index(Landed.IN_AIR))


@pytest.mark.parametrize(("wrong", "says"), [
    ({"period_ns": 0}, "period_ns=0"), ({"offset_ns": MS}, "offset_ns"), ({"execution_ns": MS}, "never keeps up"),
    ({"navigation_every": 0}, "navigation_every"), ({"airframe": {"mass_kg": -1.0}}, "mass_kg"),
    ({"parameters": {"POS_KP": -1.0}}, "POS_KP=-1: expected 0 to 20"),
    ({"parameters": {"NONE": 1.0}}, "NONE: no such parameter"),
])
def test_settings_that_make_no_sense_are_refused(wrong: dict, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        AutopilotSettings(**wrong)


def test_a_scenario_is_told_what_its_autopilots_lack() -> None:
    own = {name: OwnAgent(name, AutopilotSettings(), SimpleNamespace(media=media, plant=plant))
           for name, media, plant in (("good", ("mocap",), object()), ("deaf", ("radio",), None))}

    said = list(Autopilot.check(SimpleNamespace(), own))

    assert said == [
        "agents.deaf.parameters: mocap='mocap': no such port; there are radio; name the sensing medium that tells the "
        "vehicle where it is",
        f"agents.deaf: {NO_PLANT}"]


def test_a_vehicle_without_commands_stays_disarmed(bench: Bench) -> None:
    uav = bench().run(1.0)

    assert uav.controller.arm() is Result.ACCEPTED
    assert uav.ned() == (0.0, 0.0, 0.0)
