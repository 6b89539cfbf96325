"""The way of a key from the text of a scenario to the object that is built with it is short."""

from __future__ import annotations

import pytest

from experiments.scenario import load
from tests.experiments.scenario.hops import hops

MOST = 8


@pytest.mark.parametrize(("before", "after", "value", "last"), [
    ('preset = "crazyflie_p2p"', "bit_rate_bps = 1_234_567", 1_234_567, "RadioSettings.__init__"),
    ("loss_ratio = 0.25", "loss_ratio = 0.1234567", 0.1234567, "GilbertElliott.__init__"),
    ("{ slot_ms = 1.1 }", "{ slot_ms = 1.1, gain = 1.234567 }", 1.234567, "check_program"),
    ("{ offset_us = 5 }", "{ drift_ppm = 1.234567 }", 1.234567, "ClockSettings.__init__"),
], ids=["media.radio.bit_rate_bps", "impairments[0].loss_ratio", "agents.r1.parameters.gain",
        "agents.r1.clock.drift_ppm"])
def test_a_key_takes_few_hops(before, after, value, last, valid, write):
    path = write(valid.replace(', parameters_from = "team.models.r1"', "").replace(before, after))
    load(path)      # what is imported on the way is there now

    way = hops(lambda: load(path), value, last)

    assert way[0] == "read"
    assert len(way) <= MOST, way
