"""Which outputs of a plant become signals: every number, in the order of its description, up to a stated number."""

from __future__ import annotations

from pathlib import Path

import pytest

from firmware_sim.recorded_outputs import MOST_RECORDED, record_outputs
from fmus.build import build_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from netem.node.node import Node
from netem.wire.messages import Grant

MODEL = """
model = "many"
functions = []
variable = [
  { name = "first", kind = "output", unit = "m", start = 1.0, about = "one number" },
  { name = "wide", kind = "output", unit = "1", size = [70], start = 2.0, about = "more than are recorded" },
]
"""


@pytest.fixture
def plant(tmp_path: Path) -> Plant:
    (tmp_path / "variables.toml").write_text(MODEL)
    (tmp_path / "model.c").write_text(
        '#include "variables.h"\nvoid model_step(Values *v, double h) { (void)v, (void)h; }\n')
    return Plant(describe(build_model(tmp_path)), "p")


def test_at_most_a_stated_number_is_recorded_and_what_is_left_out_is_told(plant: Plant) -> None:
    node = Node("p", [], 1_000_000)

    record_outputs(node, plant)

    names = [name for name, _ in node.hello().signals]
    assert names == ["first", *(f"wide[{k}]" for k in range(1, MOST_RECORDED))]
    (event,) = node.advance(Grant(1, 1, False, True, [])).events
    assert event == (0, "outputs not recorded", "7 of 71 numbers: at most 64 of a plant are; a program can record "
                     "others with board.record")


def test_a_plant_that_has_stopped_leaves_no_numbers(plant: Plant) -> None:
    node = Node("p", [], 1_000_000)
    record_outputs(node, plant)
    plant.close()

    ((_, values),) = node.advance(Grant(1, 1, False, True, [])).samples

    assert all(value != value for value in values)
