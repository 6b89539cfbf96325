"""Encoders count the plant's angle, and PWM stages drive its inputs with their mean output."""

from __future__ import annotations

from collections.abc import Callable
from math import floor, pi
from pathlib import Path

import pytest

import marconet
from firmware_sim.cortex_m.errors import MachineFault
from firmware_sim.cortex_m.program import CortexMSettings
from tests.firmware_sim.cortex_m.boards import board_node, offers

COUNTS, RANGE, FULL_SCALE = 512, 1_000, 120.0        # per revolution, of the counter, rad/s
SCENARIO = """
seed = 1
length_s = 0.4
sample_period_s = 0.001
[agents.a]
program = "firmware_sim.cortex_m.program:CortexM"
plant = {{ fmu = "unicycle", parameters = {{ tau_wheel_s = 0.0 }} }}
[agents.a.parameters]
image = "{image}"
cycles_per_instruction = {cost}
signals = ["count", "total", "down"]
encoders = ["angle_right", "angle_left"]
counts_per_revolution = [100, 512]
pwms = ["u_left"]
full_scales = [120.0]
[media]
"""


@pytest.mark.parametrize("cost", [0.0, 0.1])
def test_a_wheel_turns_with_the_mean_output_and_its_encoder_counts(image: Callable[..., Path], tmp_path: Path,
                                                                   cost: float):
    scenario = tmp_path / "servo.toml"
    scenario.write_text(SCENARIO.format(image=image("servo"), cost=cost))

    signals = marconet.run(scenario, host="inline", out=tmp_path / "run").signals["a"]

    speed, angle = list(signals["wheel_left"]), list(signals["angle_left"])
    for ms, share in ((50, 0.75), (150, -0.5), (250, 1.0), (350, 0.0)):
        assert speed[ms] == share * FULL_SCALE
    counts = [floor(radians / (2 * pi) * COUNTS) for radians in angle]
    # the program captures at the beginning of a millisecond, at which the sample is taken if computing takes no time
    late = [(total, count, reference) for total, count, reference in
            zip(signals["total"], signals["count"], counts, strict=True)]
    assert max(counts) > RANGE          # so the counter has wrapped around
    for total, count, _ in late:
        assert count == total % RANGE
    if cost == 0:
        assert [total for total, _, _ in late[:-1]] == counts[:-1]
        assert list(signals["down"])[50:301:100] == [0, 1, 0]
    else:
        assert all(abs(total - before) <= 2 for (total, _, _), before in zip(late[1:], counts, strict=False))


def test_what_the_scenario_has_not_is_no_register(image: Callable[..., Path]):
    with pytest.raises(MachineFault, match=r"r1: 0x40005028 is no register"):
        offers(board_node(image("servo")), 1_000)


def test_a_stage_needs_its_full_scale():
    with pytest.raises(ValueError, match=r"full_scales=\[\]: expected one for each of the 1 names in pwms"):
        CortexMSettings(Path("x.elf"), pwms=["u"])
