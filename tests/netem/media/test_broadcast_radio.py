from random import Random

import pytest

from netem.core.fate import Fate
from netem.impairments.corrupt import Corrupt
from netem.topology.path_loss import PathLoss
from netem.topology.switching_graph import GraphChange, SwitchingGraph
from tests.netem.media.radio_bench import BYTE_PER_US, US, Bench, graph

ABC = ["a", "b", "c"]


def test_a_lone_frame_reaches_everyone_in_range_after_airtime_and_latency():
    bench = Bench(ABC, **BYTE_PER_US, receive_latency_ns=7)

    bench.run([(1_000, "a", 10)])

    assert bench.heard == [(1_000 + 10 * US + 7, "b", bytes(10)), (1_000 + 10 * US + 7, "c", bytes(10))]


def test_nobody_hears_beyond_a_directed_link():
    bench = Bench(ABC, topology=graph("a -> b"), **BYTE_PER_US)

    bench.run([(0, "a", 10), (20 * US, "b", 10)])

    assert [receiver for _, receiver, _ in bench.heard] == ["b"]
    assert bench.ledger.expected == 1


def test_back_to_back_frames_do_not_collide():
    bench = Bench(ABC, **BYTE_PER_US)

    bench.run([(0, "a", 10), (10 * US, "c", 10)])

    assert bench.fate("a", 0, "b") is Fate.DELIVERED
    assert bench.fate("c", 0, "b") is Fate.DELIVERED
    assert bench.fate("a", 0, "c") is Fate.DELIVERED


@pytest.mark.parametrize("second_ns", [0, 5 * US, 10 * US - 1])
def test_any_overlap_of_two_frames_in_range_loses_both(second_ns):
    bench = Bench(ABC, **BYTE_PER_US)

    bench.run([(0, "a", 10), (second_ns, "c", 10)])

    assert bench.fate("a", 0, "b") is Fate.COLLIDED
    assert bench.fate("c", 0, "b") is Fate.COLLIDED


def test_a_receiver_that_transmits_during_any_part_is_deaf():
    bench = Bench(ABC, topology=graph("a -> b"), **BYTE_PER_US)

    bench.run([(0, "a", 10), (10 * US - 1, "b", 10)])

    assert bench.fate("a", 0, "b") is Fate.DEAF


def test_three_frames_in_a_chain_of_overlaps_all_collide_and_a_fourth_behind_them_does_not():
    bench = Bench(["a", "b", "c", "d", "hub"], topology=graph("* -> hub"), **BYTE_PER_US)

    bench.run([(0, "a", 10), (9 * US, "b", 10), (18 * US, "c", 10), (28 * US, "d", 10)])

    assert [bench.fate(sender, 0, "hub") for sender in "abcd"] == [
        Fate.COLLIDED, Fate.COLLIDED, Fate.COLLIDED, Fate.DELIVERED]


def test_a_frame_that_outlasts_its_rival_is_lost_all_the_same():
    bench = Bench(["a", "b", "hub"], topology=graph("* -> hub"), **BYTE_PER_US)

    bench.run([(0, "a", 100), (10 * US, "b", 1)])

    assert bench.fate("a", 0, "hub") is Fate.COLLIDED
    assert bench.fate("b", 0, "hub") is Fate.COLLIDED


def test_hidden_nodes_collide_at_the_node_between_them():
    bench = Bench(ABC, topology=graph("a <-> b", "b <-> c"), **BYTE_PER_US)

    bench.run([(0, "a", 10), (5 * US, "c", 10)])

    assert bench.fate("a", 0, "b") is Fate.COLLIDED
    assert bench.fate("c", 0, "b") is Fate.COLLIDED
    assert bench.ledger.expected == 2


def test_exposed_nodes_reach_their_outer_neighbours_at_the_same_time():
    bench = Bench(["a", "b", "c", "d"], topology=graph("a <-> b", "b <-> c", "c <-> d"), **BYTE_PER_US)

    bench.run([(0, "b", 10), (0, "c", 10)])

    assert bench.fate("b", 0, "a") is Fate.DELIVERED
    assert bench.fate("c", 0, "d") is Fate.DELIVERED
    assert bench.fate("b", 0, "c") is Fate.DEAF
    assert bench.fate("c", 0, "b") is Fate.DEAF


def test_a_node_hears_again_at_the_instant_its_own_frame_ends():
    bench = Bench(["a", "b"], **BYTE_PER_US)

    bench.run([(0, "a", 10), (10 * US, "b", 10), (20 * US, "a", 10)])

    assert [receiver for _, receiver, _ in bench.heard] == ["b", "a", "b"]


def test_the_local_model_knows_neither_collisions_nor_deafness():
    bench = Bench(ABC, decode="local", **BYTE_PER_US)

    bench.run([(0, "a", 10), (5 * US, "b", 10)])

    assert bench.ledger.closed == {Fate.DELIVERED: 4}


def test_frames_without_airtime_never_overlap_and_make_nobody_deaf():
    bench = Bench(ABC)

    bench.run([(5, "a", 100), (5, "b", 0), (5, "a", 0)])

    assert bench.ledger.closed == {Fate.DELIVERED: 6}
    assert {arrival_ns for arrival_ns, _, _ in bench.heard} == {5}


def test_a_frame_on_the_air_during_a_switch_is_heard_by_the_graph_of_its_start():
    switching = SwitchingGraph("switching", {"east": ("a -> b",), "west": ("a -> c",)},
                               (GraphChange(0, "east"), GraphChange(5 * US, "west")))
    bench = Bench(ABC, topology=switching, **BYTE_PER_US)

    bench.run([(4 * US, "a", 10), (14 * US, "a", 10)])

    assert [(arrival_ns, receiver) for arrival_ns, receiver, _ in bench.heard] == [(14 * US, "b"), (24 * US, "c")]


def test_a_rival_disturbs_those_who_were_in_its_range_when_it_started():
    switching = SwitchingGraph("switching", {"near": ("a -> b", "c -> b"), "far": ("a -> b",)},
                               (GraphChange(0, "near"), GraphChange(5 * US, "far"), GraphChange(50 * US, "near")))
    bench = Bench(ABC, topology=switching, **BYTE_PER_US)

    bench.run([(4 * US, "c", 10), (6 * US, "a", 10),            # c started in range of b, a started after the switch
               (48 * US, "c", 10), (51 * US, "a", 10)])         # c started out of range of b

    assert bench.fate("a", 0, "b") is Fate.COLLIDED
    assert bench.fate("a", 1, "b") is Fate.DELIVERED


def test_handing_out_while_transmitting_loses_the_new_frame_only():
    bench = Bench(["a", "b"], **BYTE_PER_US)

    bench.run([(0, "a", 10), (5 * US, "a", 10), (10 * US, "a", 10)])

    assert [bench.fate("a", number, "b") for number in range(3)] == [Fate.DELIVERED, Fate.SENDER_BUSY, Fate.DELIVERED]


def test_an_empty_payload_is_a_frame_and_one_too_long_is_counted():
    bench = Bench(["a", "b"], preset="crazyflie_p2p")

    bench.run([(0, "a", 0), (10**6, "a", 60), (2 * 10**6, "a", 61)])

    assert [bench.fate("a", number, "b") for number in range(3)] == [Fate.DELIVERED, Fate.DELIVERED, Fate.MALFORMED]
    assert len(bench.heard) == 2


def test_a_frame_on_the_air_when_the_run_ends_is_unfinished():
    bench = Bench(ABC, **BYTE_PER_US)

    bench.run([(0, "a", 10)], until_ns=10 * US)

    assert bench.ledger.closed == {Fate.UNFINISHED: 2}


def test_nodes_with_positions_hear_by_distance():
    at_m = {"a": (0.0, 0.0), "near": (10.0, 0.0), "edge": (150.0, 0.0), "far": (1000.0, 0.0)}
    bench = Bench(at_m, topology=PathLoss("positions", reference_loss_db=40.0, exponent=2.5), tx_power_dbm=0.0,
                  sensitivity_dbm=-90.0, **BYTE_PER_US)      # -65, -94.4 and -115 dBm

    bench.run([(0, "a", 1)])

    assert bench.ledger.closed == {Fate.DELIVERED: 1, Fate.TOO_WEAK: 1}
    assert bench.fate("a", 0, "edge") is Fate.TOO_WEAK


@pytest.mark.parametrize(("decode", "fate"), [("capture", Fate.COLLIDED), ("radio_network", Fate.DELIVERED)])
def test_a_node_out_of_range_disturbs_under_capture_only(decode, fate):
    at_m = {"a": (0.0, 0.0), "b": (90.0, 0.0), "jammer": (240.0, 0.0)}       # b gets -88.9 and -94.4 dBm
    bench = Bench(at_m, topology=PathLoss("positions", reference_loss_db=40.0, exponent=2.5, fringe_db=0.0),
                  sensitivity_dbm=-90.0, decode=decode, capture_db=6.0, **BYTE_PER_US)

    bench.run([(0, "a", 10), (1 * US, "jammer", 1)])

    assert bench.ledger.expected == 1
    assert bench.fate("a", 0, "b") is fate


@pytest.mark.parametrize(("checksum", "fate"), [(True, Fate.CORRUPTED), (False, Fate.DELIVERED_CORRUPT)])
def test_the_links_learn_whether_the_radio_has_a_checksum(checksum, fate):
    noise = {("radio", "a", "b"): [("noise", Corrupt(frame_ratio=1.0, rng=Random(7)))]}
    bench = Bench(["a", "b"], pipelines=noise, checksum=checksum, **BYTE_PER_US)

    bench.run([(0, "a", 8)])

    assert bench.fate("a", 0, "b") is fate
