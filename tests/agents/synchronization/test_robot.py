"""The robot program on a node of its own: whatever reaches its port, it keeps its slots."""

from __future__ import annotations

from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from agents.synchronization.preparation import prepare
from agents.synchronization.robot import SyncRobot, SyncSettings
from agents.synchronization.sync_frame import SyncFrameCodec
from experiments.run.node_build import build_node
from experiments.run.node_specifications import node_specifications
from experiments.scenario import find, load
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from netem.node.node import Node
from netem.wire.messages import Grant
from tests.examples import examples

END_NS = 30_000_000


@pytest.fixture(scope="module")
def specification() -> Any:
    return node_specifications(load(find("output_sync")))["r1"]


def spoken(node: Node, frames: list[tuple[int, bytes]]) -> list[int]:
    deliveries = [(at_ns, 0, data) for at_ns, data in sorted(frames, key=lambda frame: frame[0])]
    report = node.advance(Grant(1, END_NS, False, True, deliveries))
    assert report.error == ""
    assert all(np.isfinite(value) for _, values in report.samples for value in values)
    return [at_ns for at_ns, _, _ in report.offers]


@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(frames=st.lists(st.tuples(st.integers(0, END_NS - 1), st.binary(max_size=70)), max_size=30))
def test_random_bytes_change_neither_slots_nor_plant(specification: Any, frames: list[tuple[int, bytes]]) -> None:
    undisturbed = spoken(build_node(specification), [])

    disturbed = build_node(specification)

    assert spoken(disturbed, frames) == undisturbed
    # Slots of boot_slot_s = 1 ms, five robots in turn, the first of them this one; guard 20 us; control slots between.
    assert undisturbed[0] == 20_000


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_an_output_that_is_no_number_is_refused(value: float) -> None:
    codec = SyncFrameCodec(5, 1)

    assert codec.unpack(codec.pack(1, 7, [value])) is None
    assert codec.unpack(codec.pack(5, 7, [1.0])) is None        # there is no sixth robot
    sound = codec.unpack(codec.pack(1, 7, [1.0]))
    assert sound is not None
    assert (sound.sender, sound.slot, sound.values) == (1, 7, (1.0,))


def test_a_robot_needs_a_plant() -> None:
    scenario = load(find("output_sync"))
    node = Node("r1", ["radio"])
    clock = LocalClock(ClockSettings(), node.env.time_ns)
    board = Board(node, clock, None, dict(scenario.team) | prepare(scenario, {}), Random(0), {})

    with pytest.raises(ValueError, match=r"r1 has no plant; give it one, as agents.r1.plant = "):
        SyncRobot(board, SyncSettings())
