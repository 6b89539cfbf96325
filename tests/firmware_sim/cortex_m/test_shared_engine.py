"""Boards of one process that run the same image at no cost share an engine, but neither registers nor RAM.

Of the RAM only what a program uses is copied, when boards take turns and when a run ahead is undone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from netem.node.node import Node
from netem.wire.messages import Grant
from tests.firmware_sim.cortex_m.boards import board_node

FAR, NEAR = 1.0, 0.0


def sums(node: Node, window: int, numbers: list[int]) -> list[int]:
    """Let the board hear these numbers; return what it sends."""
    arrivals = [(window * 1_000 + k, 0, number.to_bytes(4, "little")) for k, number in enumerate(numbers)]
    report = node.advance(Grant(window, (window + 1) * 1_000, False, False, arrivals))
    return [int.from_bytes(data, "little") for _, _, data in report.offers]


@pytest.mark.parametrize("places", [(NEAR, NEAR, NEAR), (NEAR, FAR, FAR), (FAR, NEAR, FAR)])
def test_each_board_has_its_own_ram_also_where_its_image_declares_none(image: Callable[..., Path],
                                                                       places: tuple[float, ...]):
    nodes = [board_node(image("far"), values=[[place]]) for place in places]
    random, total = Random(1), [0] * len(nodes)

    for window in range(1, 60):
        number = random.randrange(len(nodes))
        heard = [random.randrange(1_000) for _ in range(random.randrange(1, 4))]
        expected = []
        for each in heard:
            total[number] += each
            expected.append(total[number])
        assert sums(nodes[number], window, heard) == expected


def test_a_board_that_is_closed_leaves_the_others_running(image: Callable[..., Path]):
    nodes = [board_node(image("far"), values=[[NEAR]]) for _ in range(3)]
    for node in nodes:
        assert sums(node, 1, [5]) == [5]

    nodes[2].close()                    # the one whose registers and RAM the engine has
    assert sums(nodes[0], 2, [2]) == [7]
    nodes[0].close()
    again = board_node(image("far"), values=[[NEAR]])

    assert sums(nodes[1], 2, [3]) == [8]
    assert sums(again, 3, [4]) == [4]


@pytest.mark.parametrize("place", [NEAR, FAR])
def test_a_run_ahead_that_is_undone_leaves_no_trace_in_the_ram(image: Callable[..., Path], place: float):
    node = board_node(image("far"), values=[[place]], cycles_per_instruction=50.0)      # each frame takes long
    arrivals = [(2_000_000 + 100 * k, 0, bytes([1, 0, 0, 0])) for k in range(20)]       # ... so it is ahead of some

    report = node.advance(Grant(1, 100_000_000, False, False, arrivals))

    assert [int.from_bytes(data, "little") for _, _, data in report.offers] == list(range(1, 21))
