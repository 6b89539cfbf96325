"""Section 4.7 on the emulator: the companion predicts the tracking error between looks over radio and bus."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from agents.tracking.controller import Inputs, Pose, placed, tracking_error
from agents.tracking.predicted_error import PredictedError
from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from experiments.scenario.library import find

MS = 1_000_000
LOOK_NS = 2 * MS        # an exchange over the radio takes 0.9 ms, and is asked for early by that


@pytest.fixture(scope="module")
def predicted(tmp_path_factory: pytest.TempPathFactory) -> RunData:
    scenario = load(find("tracking_predicted"), duration_s=3.0, overrides=["expect={}"])
    return load_run(run(scenario, host="inline", out=tmp_path_factory.mktemp("predicted"), report=False).folder)


def test_looks_come_when_the_prediction_could_be_too_far_off(predicted: RunData) -> None:
    """Nine intervals at 1 m/s until the inputs change at 2.26 s, then those at 0.6 m/s."""
    asked_ns = np.unique(predicted.ledger.only(sender="companion", medium="radio").ints("offered_ns"))

    slow, fast = (PredictedError(0.4).decide(0, (0.0, 0.0, 0.0), Inputs(v, 0.0)).interval_ns for v in (0.6, 1.0))
    apart_ns = np.diff(asked_ns)
    assert np.all((apart_ns[:8] > fast - LOOK_NS) & (apart_ns[:8] <= fast))
    assert len(asked_ns) == 10 + (3_000 * MS - 2_260 * MS) // slow
    assert predicted.counters["companion"]["measurements"] == len(asked_ns) + 1        # and one announcement


def test_the_prediction_is_no_further_off_than_it_may_be(predicted: RunData) -> None:
    error, companion = predicted.signals["error"], predicted.signals["companion"]
    off = [hypot(*(companion.column(f"held{k}")[i] - error.column(f"x{k}")[i] for k in (1, 2, 3)))
           for i in range(len(error.time_ns)) if error.time_ns[i] > 500 * MS]

    moved = 0.01 * 3.0          # between two control instants, of a robot below 3 m/s
    assert 0.1 < max(off) <= 0.4 + moved
    assert not [event for event in predicted.events if event.kind == "assumption violated"]


def test_the_command_follows_the_prediction_at_its_control_instants(predicted: RunData) -> None:
    held = predicted.signals["companion"].column("held1")

    setpoints = np.unique(predicted.ledger.only(sender="companion", medium="can").ints("offered_ns"))
    assert len(np.unique(held)) > 0.9 * len(held)       # held measurements would give ten values
    assert len(setpoints) > 0.9 * 3_000 / 10            # and a setpoint every 50 ms


def test_placing_is_the_inverse_of_the_tracking_error() -> None:
    own, x = Pose(1.0, -2.0, 0.7), (0.3, -0.4, 1.9)

    np.testing.assert_allclose(tracking_error(own, placed(own, x)), x, atol=1e-15)


@pytest.mark.parametrize(("key", "said"), [
    ("tolerance=0.2", "tolerance=0.2: a measurement alone may be 0.259808 off, expected more"),
    ("control_ms=0", "control_ms=0 (control_ns=0): expected 1 or more between two commands"),
    ("input_error=-1", "input_error=-1")])
def test_what_cannot_be_is_refused_before_the_start(key: str, said: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        load(find("tracking_predicted"), overrides=[f"agents.companion.parameters.{key}"])

    assert [line for line in refused.value.problems if said in line]
