"""Faults of media in runs, on both hosts: jammers, blind and wrong sensors, CAN controllers, a bus stuck dominant."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from netem.media.sensing.sight import Detection, unpack_sight
from tests.experiments.run.fault_bench import MS, Ran

RADIO = """
seed = 7
length_s = 1.0
[agents_defaults]
program = "beacon:Beacon"
[agents]
a = { parameters = { offset_ms = 0 }, at_m = [0.0, 0.0] }
b = { parameters = { offset_ms = 3 }, at_m = [10.0, 0.0] }
c = { parameters = { offset_ms = 6 }, at_m = [10.0, 10.0] }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p" }
"""
CSMA = RADIO.replace('preset = "crazyflie_p2p"', 'preset = "xbee_802154", mac = "csma"')
SIGHT = """
seed = 7
length_s = 1.0
[agents]
a = { program = "beacon:Beacon", parameters = { offset_ms = 0 } }
b = { program = "beacon:Beacon", parameters = { offset_ms = 0, v = 0.5 }, plant = { fmu = "unicycle" } }
w = { program = "watch:Watch" }
[media]
radio = { kind = "broadcast_radio" }
[media.view]
kind = "sensing"
exposure_period_ms = 10
latency_ms = 2
bodies = { b = ["x", "y", "theta"] }
every_exposure_to = ["w"]
"""
BUS = """
seed = 7
length_s = 1.0
[agents]
a = { program = "talk:Talk", parameters = { can_id = 0x100, offset_us = 0 } }
b = { program = "talk:Talk", parameters = { can_id = 0x200, offset_us = 100 } }
c = { program = "talk:Talk", parameters = { can_id = 0x300, offset_us = 200 } }
[media]
can = { kind = "can", bit_rate_bps = 500000, queue_frames = 4 }
"""


@pytest.mark.parametrize("where", ['nodes = ["b", "c"]', 'zone = { kind = "circle", centre_m = [10, 5], radius_m = 6 }',
                                   'zone = { kind = "rectangle", low_m = [10, 0], high_m = [20, 20] }'])
def test_a_jammer_loses_what_overlaps_its_bursts_where_it_is_heard(both: Any, where: str) -> None:
    ran = both('[[faults]]\nkind = "jam"\nname = "noise"\non = "radio"\nduring_s = [0.3, 0.6]\nduty_cycle = 0.25\n'
               f"period_ms = 20\n{where}\n", RADIO)

    for row in ran.rows:
        bursts = [(start * MS, (start + 5) * MS) for start in range(300, 600, 20)]
        hit = any(row["on_air_ns"] < end and row["end_ns"] > start for start, end in bursts)
        jammed = row["receiver"] in "bc" and hit
        assert (row["fate"], row["cause"]) == (("jammed", "noise jam") if jammed else ("delivered", "")), row
    assert len(ran.copies(fate="jammed")) == 15 * 3     # a frame of a to b and c, and one of b to c, in each burst


@pytest.mark.parametrize("sensed", [True, False])
def test_carrier_sense_waits_for_a_jammer_that_it_senses(both: Any, sensed: bool) -> None:
    ran = both('[[faults]]\nkind = "jam"\non = "radio"\nduring_s = [0.3, 0.6]\nnodes = ["*"]\n'
               f"sensed = {str(sensed).lower()}\n", CSMA)

    within = [row for row in ran.rows if row["on_air_ns"] >= 0 and 300 * MS <= row["on_air_ns"] < 600 * MS]
    if sensed:
        assert not within
        assert ran.copies(fate="channel busy")
    else:
        assert {row["fate"] for row in within} == {"jammed"}
        assert not ran.copies(fate="channel busy")


def test_a_robot_that_drives_through_a_jammed_zone_is_deaf_there(both: Any) -> None:
    driving = """
seed = 7
length_s = 4.0
[agents]
a = { program = "beacon:Beacon", parameters = { offset_ms = 0 }, at_m = [0.0, 5.0] }
b = { program = "beacon:Beacon", parameters = { offset_ms = 3, v = 1.0, omega = 0.0 }, plant = { fmu = "unicycle" } }
[media]
radio = { kind = "broadcast_radio", topology = { kind = "positions", bodies = { b = ["x", "y"] } } }
"""
    ran = both('[[faults]]\nkind = "jam"\non = "radio"\nat_s = 0.0\n'
               'zone = { kind = "circle", centre_m = [2.0, 0.0], radius_m = 1.0 }\n', driving)

    jammed_s = [row["on_air_ns"] / 1e9 for row in ran.copies(receiver="b", fate="jammed")]
    # 1 m/s from the origin: inside from 1 s to 3 s, known one pose of 10 ms later at most
    assert (min(jammed_s), max(jammed_s)) == pytest.approx((1.0, 3.0), abs=0.011)
    assert len(jammed_s) == pytest.approx(200, abs=2)
    assert not ran.copies(receiver="a", fate="jammed")


def seen(ran: Any) -> dict[int, Detection | None]:
    """Places that w was told, by exposure [ms]; None where it saw nothing."""
    found: dict[int, Detection | None] = {}
    for event in ran.data.events:
        if (event.node, event.kind) == ("w", "saw"):
            sight = unpack_sight(bytes.fromhex(event.detail))
            assert sight is not None
            found[round(sight.exposed_ns / MS)] = sight if isinstance(sight, Detection) else None
    return found


@pytest.mark.parametrize("fault", ["blackout", "bias", "stuck", "noise"])
def test_a_sensor_is_blind_or_wrong_within_the_window(both: Any, tmp_path: Path, fault: str) -> None:
    keys = {"bias": "by_m = [1.0, -2.0]", "noise": "sigma_m = 0.5"}.get(fault, "")
    right = seen(Ran(tmp_path / "right", "inline", "", SIGHT))
    ran = both(f'[[faults]]\nkind = "{fault}"\nname = "sun"\non = "view: b -> w"\nduring_s = [0.3, 0.6]\n{keys}\n',
               SIGHT)

    wrong = seen(ran)
    assert wrong.keys() == right.keys()
    inside = [ms for ms in right if 300 <= ms < 600]
    assert len(inside) == 30
    assert all(wrong[ms] == right[ms] for ms in right if ms not in inside)
    off = np.array([(wrong[ms].x_m - right[ms].x_m, wrong[ms].y_m - right[ms].y_m) for ms in inside
                    if wrong[ms] is not None])
    blind = ran.copies(fate="blacked out")
    if fault == "blackout":
        assert len(off) == 0
        assert [row["cause"] for row in blind] == ["sun blackout"] * 30
        return
    assert not blind
    if fault == "bias":
        np.testing.assert_allclose(off, np.tile([1.0, -2.0], (30, 1)))
    elif fault == "stuck":
        assert {(wrong[ms].x_m, wrong[ms].y_m) for ms in inside} == {(right[300].x_m, right[300].y_m)}
    else:                                       # 60 normal numbers: four standard errors of their deviation
        assert off.std() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(2 * 60))


def test_a_controller_that_is_bus_off_sends_and_takes_nothing_until_it_recovers(both: Any) -> None:
    ran = both('[[faults]]\nkind = "bus_off"\non = "can"\nnodes = ["b"]\nat_s = 0.3004\n', BUS)

    off = [row for row in ran.rows if row["fate"] == "bus off"]
    left_ns, recovered_ns = (event.time_ns for event in ran.data.events
                             if event.node == "b" and event.kind in ("bus-off", "error-active"))
    on_bus = sorted({(row["on_air_ns"], row["end_ns"]) for row in ran.rows if row["on_air_ns"] >= 0})
    # its own frame was on the bus, and is completed; then 128 runs of 11 recessive bits, from 8 before a frame's end
    assert left_ns == next(end_ns for start_ns, end_ns in on_bus if start_ns <= 300.4 * MS < end_ns) + 3 * 2000
    runs, run_ns = 0, left_ns
    for start_ns, end_ns in on_bus:
        if start_ns >= left_ns and runs + (start_ns - run_ns) // 22_000 < 128:
            runs, run_ns = runs + (start_ns - run_ns) // 22_000, end_ns - 8 * 2000
    assert recovered_ns == run_ns + (128 - runs) * 22_000
    for row in ran.rows:
        waits = row["sender"] == "b" and left_ns <= row["offered_ns"] < recovered_ns
        misses = row["receiver"] == "b" and left_ns <= row["on_air_ns"] < recovered_ns
        assert (row["fate"] == "bus off") == (waits or misses), row
    assert off
    assert {event.kind for event in ran.data.events if event.node == "b"} >= {"bus-off"}


def test_a_babbling_controller_fills_the_bus_and_lower_priorities_starve(both: Any) -> None:
    ran = both('[[faults]]\nkind = "babble"\non = "can"\nnodes = ["b"]\ncan_id = 0x180\nduring_s = [0.3, 0.5]\n', BUS)

    within = sorted({row["on_air_ns"] for row in ran.rows if 301 * MS < row["on_air_ns"] < 500 * MS})
    ends = {row["on_air_ns"]: row["end_ns"] for row in ran.rows}
    gaps = [after - ends[before] for before, after in pairwise(within)]
    assert set(gaps) == {3 * 2000}                      # intermission after intermission: never idle
    by_sender = {name: len({row["on_air_ns"] for row in ran.copies(sender=name, fate="delivered")
                            if 301 * MS < row["on_air_ns"] < 500 * MS}) for name in "abc"}
    assert by_sender["a"] == 199                        # a higher priority gets through, the others starve
    assert by_sender["c"] == 0
    assert by_sender["b"] == len(within) - 199
    assert [row for row in ran.copies(sender="c") if row["fate"] == "queue full"]


def test_nothing_gets_through_a_bus_that_is_stuck_dominant(both: Any) -> None:
    # a sends at 0.3 s: its frame is met 100 us after its start
    ran = both('[[faults]]\nkind = "stuck_dominant"\non = "can"\nduring_s = [0.3001, 0.3201]\n', BUS)

    bit_ns = 2000
    assert not [row for row in ran.rows if row["on_air_ns"] >= 0 and 299.9 * MS < row["end_ns"] < 320.1 * MS
                and row["fate"] == "delivered"]
    events = [(event.time_ns, event.node, event.kind) for event in ran.data.events if event.node in "abc"]
    flag_ns = next(time_ns for time_ns, node, kind in events if kind == "CAN error frame")
    assert 300.1 * MS < flag_ns <= 300.1 * MS + 6 * bit_ns
    # the sender: + 8 at the error, + 8 for each 8 dominant bits after its flag: 15 more pass 127, 31 pass 255
    assert (flag_ns + (6 + 8 * 15) * bit_ns, "a", "error-passive") in events
    assert (flag_ns + (6 + 8 * 31) * bit_ns, "a", "bus-off") in events
    # the others: + 1 and + 8 each: 16 pass 127; they stay on the bus
    assert (flag_ns + (6 + 8 * 16) * bit_ns, "b", "error-passive") in events
    assert not [event for event in events if event[1:] == ("b", "bus-off")]
    # dominant, delimiter 8, intermission 3
    first_ns = min(row["on_air_ns"] for row in ran.rows if row["on_air_ns"] > 320.1 * MS)
    assert first_ns == 320.1 * MS + 11 * bit_ns
    assert {row["fate"] for row in ran.copies(sender="a") if 300 * MS <= row["offered_ns"] < 320 * MS} == {"bus off"}
    recovered, = [time_ns for time_ns, node, kind in events if (node, kind) == ("a", "error-active")]
    assert recovered > 320.1 * MS + 128 * 11 * bit_ns - 20 * 11 * bit_ns


@pytest.mark.slow
def test_an_idle_bus_that_is_stuck_makes_all_nodes_count_as_receivers(both: Any) -> None:
    ran = both('[[faults]]\nkind = "stuck_dominant"\non = "can"\nduring_s = [0.3009, 0.3109]\n', BUS)

    bit_ns, flag_ns = 2000, 300.9 * MS + 6 * 2000
    states = [(event.time_ns, event.node) for event in ran.data.events if event.kind == "error-passive"]
    assert states == [(flag_ns + (6 + 8 * 16) * bit_ns, node) for node in "abc"]
    assert not [event for event in ran.data.events if event.kind == "bus-off"]
    assert {row["fate"] for row in ran.rows} <= {"delivered", "queue full", "unfinished"}
