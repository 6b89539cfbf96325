"""Cut links whose carriers stop as well: no collision, no deafness and no deference across the cut, on both hosts."""

from __future__ import annotations

from typing import Any

import pytest

from tests.experiments.run.fault_bench import MS, Ran

# a and c send at the same instants, every 10 ms; b and d send nothing within the run
PAIRS = """
seed = 7
length_s = 1.0
[agents_defaults]
program = "beacon:Beacon"
[agents]
a = { parameters = { offset_ms = 0 }, at_m = [0.0, 0.0] }
b = { parameters = { offset_ms = 2000 }, at_m = [10.0, 0.0] }
c = { parameters = { offset_us = C_US }, at_m = [0.0, 10.0] }
d = { parameters = { offset_ms = 2000 }, at_m = [10.0, 10.0] }
[media]
radio = { kind = "broadcast_radio", RADIO }
"""
HALVES = '[[faults]]\nkind = "partition"\nname = "wall"\non = "radio"\ngroups = [["a", "b"], ["c", "d"]]\n'
ACROSS = {"ac", "ad", "ca", "cb"}


def pairs(radio: str, c_us: int = 0) -> str:
    return PAIRS.replace("C_US", str(c_us)).replace("RADIO", radio)


def fates(ran: Ran, from_ms: float, until_ms: float, way: str) -> set[str]:
    """Fates of the copies on a way, sender and receiver, whose frames started in [from, until)."""
    return {row["fate"] for row in ran.rows if row["sender"] + row["receiver"] == way
            and from_ms * MS <= row["on_air_ns"] < until_ms * MS}


@pytest.mark.parametrize("radio", [
    'preset = "crazyflie_p2p"',
    pytest.param('preset = "crazyflie_p2p", decode = "capture"', marks=pytest.mark.slow),
    pytest.param('preset = "crazyflie_p2p", decode = "capture", topology = { kind = "positions" }',
                 marks=pytest.mark.slow),
    'preset = "crazyflie_p2p", topology = { kind = "positions", propagation_mps = 299792458 }'])
def test_groups_that_would_collide_for_certain_do_not_where_carriers_stop(both: Any, radio: str) -> None:
    # 8 bytes last 76.5 us: the frames at 300 and at 500 ms are on the air when the window begins, and when it ends
    during = "during_s = [0.30004, 0.50004]\n"
    crossing = both(HALVES + during + 'carriers = "cross"\n', pairs(radio))
    stopped = both(HALVES + during + 'carriers = "stop"\n', pairs(radio))

    for way in ("ab", "cd"):
        assert fates(crossing, 0, 1000, way) == {"collided"}
        assert fates(stopped, 0, 300.05, way) == {"collided"}       # on the air already: its carrier crosses
        assert fates(stopped, 300.05, 500.05, way) == {"delivered"}
        assert fates(stopped, 500.05, 1000, way) == {"collided"}
    for way in ACROSS:
        lost = "deaf" if way in ("ac", "ca") else "collided"
        assert fates(crossing, 0, 1000, way) == {lost}
        assert fates(stopped, 0, 300.05, way) == {lost}
        assert fates(stopped, 300.05, 500.05, way) == {"cut"}       # that at 500 ms too, which ends after the window
        assert fates(stopped, 500.05, 1000, way) == {lost}
    assert {row["cause"] for row in stopped.copies(fate="cut")} == {"wall partition"}
    assert len(stopped.copies(fate="cut")) == 20 * len(ACROSS)


def test_a_radio_does_not_wait_for_carriers_that_a_cut_stops(both: Any) -> None:
    # first look of 128 us and turnaround of 192 us: first bit 320 us after the offer. a is on the air from 320 us after
    # its offer for 864 us, and c looks at the channel 700 us after it
    radio = 'preset = "xbee_802154", mac = "csma"'
    window = "during_s = [0.3005, 0.5005]\n"
    ran = both(HALVES + window + 'carriers = "stop"\n', pairs(radio, c_us=700))
    crossing = both(HALVES + window, pairs(radio, c_us=700))

    def waited(ran: Ran) -> dict[int, int]:
        return {round(row["offered_ns"] / MS - 0.7): row["on_air_ns"] - row["offered_ns"]
                for row in ran.copies(sender="c", receiver="d")}

    at_once = {offer_ms for offer_ms, wait_ns in waited(ran).items() if wait_ns == 320_000}
    # at 300 ms a's carrier is older than the window and crosses; that of 500 ms is not, and does not appear afterwards
    assert at_once == set(range(310, 501, 10))
    assert not [wait_ns for wait_ns in waited(crossing).values() if wait_ns == 320_000]
    assert {row["on_air_ns"] - row["offered_ns"] for row in ran.copies(sender="a")} == {320_000}


def test_one_way_carriers_stop_one_way(both: Any) -> None:
    ran = both(HALVES + 'during_s = [0.3, 0.5]\none_way = true\ncarriers = "stop"\n', pairs('preset = "crazyflie_p2p"'))

    assert fates(ran, 300, 500, "cd") == {"delivered"}
    assert fates(ran, 300, 500, "ab") == {"collided"}           # with c, which b hears
    assert fates(ran, 300, 500, "ad") == {"cut"}
    assert fates(ran, 300, 500, "cb") == {"collided"}


def test_links_that_are_down_stop_the_carriers_of_their_own_direction(both: Any) -> None:
    # two faults cut one link: the first of the file is the cause
    ran = both('[[faults]]\nkind = "link_down"\non = "radio: c -> b"\nduring_s = [0.3, 0.5]\ncarriers = "stop"\n'
               '[[faults]]\nkind = "link_down"\nname = "later"\non = "radio: c -> *"\nduring_s = [0.4, 0.6]\n'
               'carriers = "stop"\n', pairs('preset = "crazyflie_p2p"'))

    assert fates(ran, 300, 600, "ab") == {"delivered"}
    assert fates(ran, 300, 600, "cb") == {"cut"}
    assert fates(ran, 300, 400, "cd") == {"collided"}
    assert fates(ran, 400, 600, "cd") == {"cut"}
    causes = [row["cause"] for row in ran.rows if (row["sender"], row["receiver"], row["fate"]) == ("c", "b", "cut")]
    assert causes == ["faults[0] link_down"] * 20 + ["later link_down"] * 10


def test_what_is_too_weak_without_the_cut_stays_too_weak(both: Any) -> None:
    radio = 'preset = "crazyflie_p2p", topology = { kind = "fixed", levels_dbm = { "c -> b" = -90.0 } }'
    ran = both(HALVES + 'during_s = [0.3, 0.5]\ncarriers = "stop"\n', pairs(radio))

    assert fates(ran, 0, 1000, "cb") == {"too weak"}
    assert fates(ran, 300, 500, "ca") == {"cut"}
