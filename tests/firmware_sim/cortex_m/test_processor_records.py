"""Load, latency, time awake, stack and memory of an emulated processor are in the records; a slow one takes longer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import marconet
from firmware_sim.cortex_m.image import RAM, read_image
from netem.wire.messages import Grant, Report
from tests.firmware_sim.cortex_m.boards import board_node

MS, NS_PER_INSTRUCTION, ROUNDS = 1_000_000, 10, 5_000
RUN = """
seed = 1
length_s = 0.2
sample_period_s = 0.005
[agents.a]
program = "firmware_sim.cortex_m.program:CortexM"
parameters = {{ image = "{image}", values = [[5e6], [1e6], [5000]], cycles_per_instruction = 1.0 }}
[agents.b]
program = "firmware_sim.cortex_m.program:CortexM"
parameters = {{ image = "{image}", values = [[5e9], [4e9], [0]], cycles_per_instruction = 1.0 }}
[media.radio]
kind = "broadcast_radio"
bit_rate_bps = 250_000
[[faults]]
kind = "slow"
on = "a"
factor = 3.0
during_s = [0.0999, 0.1499]
[guarantees.deadline]
kind = "signal"
on = "a.awake_time"
below = 0.0005
[expect]
"guarantee.deadline.violations" = {{ max = 1 }}
"guarantee.deadline.first_violation_s" = {{ min = 0.1 }}
"""


def test_load_and_time_awake_follow_from_the_instructions_and_a_slow_fault_multiplies_them(
        image: Callable[..., Path], tmp_path: Path):
    scenario = tmp_path / "slow.toml"
    scenario.write_text(RUN.format(image=image("beacon")))

    run = marconet.run(scenario, host="inline", out=tmp_path / "run")

    took = [sent - MS - 5 * MS * k for k, sent in enumerate(run.ledger["offered_ns"])]
    slow = range(20, 30)                # rounds that begin within the fault
    assert len(took) == 40
    assert {ns for k, ns in enumerate(took) if k not in slow} == {took[0]}
    assert {took[k] for k in slow} == {3 * took[0]}
    signals = run.signals["a"]
    awake_ns = [round(s * 1e9) for s in signals["awake_time"]]
    after_frame_ns = awake_ns[2] - took[0]              # from the frame to sleep
    assert 0 < after_frame_ns < 100 * NS_PER_INSTRUCTION
    assert awake_ns[2:21] == [awake_ns[2]] * 19
    assert awake_ns[21:31] == [3 * awake_ns[2]] * 10
    assert awake_ns[31:] == [awake_ns[2]] * len(awake_ns[31:])
    load = list(signals["processor_load"])
    assert load[2] == pytest.approx(awake_ns[2] / (5 * MS), rel=1e-3)
    assert load[25] == pytest.approx(3 * load[2], rel=1e-9)
    assert dict(zip(run.expectations["key"], run.expectations["value"], strict=True)) == {
        "guarantee.deadline.violations": 1, "guarantee.deadline.first_violation_s": 0.105}


def last_report(image: Path, arrivals: list[tuple[int, int, bytes]], port_priority: float) -> Report:
    node = board_node(image, values=[[5 * MS], [MS], [ROUNDS], [port_priority]], cycles_per_instruction=1.0)
    return node.advance(Grant(1, 4 * MS, False, True, [*arrivals, (3 * MS, 0, bytes(4))]))


@pytest.mark.parametrize(("priority", "waits"), [(0x40, False), (0x80, True)])
def test_latency_is_the_time_that_an_interrupt_waits_for_those_of_its_priority(image: Callable[..., Path],
                                                                               priority: int, waits: bool):
    arrives_ns = MS + 1_003

    report = last_report(image("beacon"), [(arrives_ns, 0, bytes(4))], priority)

    (sent, _, _), = report.offers
    worst_ns = report.counters["worst interrupt latency ns"]
    if waits:
        assert sent - arrives_ns < worst_ns < sent - arrives_ns + 100 * NS_PER_INSTRUCTION
    else:
        assert 0 < worst_ns < 4 * NS_PER_INSTRUCTION    # to the end of an instruction, or of an IT block


def test_frames_that_wait_are_late_from_their_own_arrival(image: Callable[..., Path]):
    arrivals = [(MS + 1_000, 0, bytes(4)), (MS + 1_010, 0, bytes(4)), (MS + 1_020, 0, bytes(4))]

    first = last_report(image("beacon"), arrivals[:1], 0x80).counters["worst interrupt latency ns"]
    last = last_report(image("beacon"), arrivals, 0x80).counters["worst interrupt latency ns"]

    assert last > first + 2 * 10 * NS_PER_INSTRUCTION       # the third has waited for the handlers of the others too


def test_memory_is_that_of_the_image_and_of_the_deepest_stack(image: Callable[..., Path]):
    built = image("beacon")
    report = last_report(built, [], 0x40)
    nested = last_report(built, [(MS + 1_000, 0, bytes(4))], 0x40)

    assert report.counters["flash bytes"] == read_image(built).flash_bytes
    assert report.counters["RAM bytes"] == read_image(built).ram_bytes
    assert 0x20 <= report.counters["stack bytes"] < 0x100
    assert report.counters["stack bytes"] + 0x20 <= nested.counters["stack bytes"] < 0x200
    assert read_image(built).stack_low == RAM.start
