from itertools import product
from random import Random

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from agents.synchronization.discovery import Discovery, Incomplete, Phase, Topology, cycles_needed
from agents.synchronization.discovery_frame import MAX_NODES, DiscoveryFrame
from agents.synchronization.graph import laplacian, unreachable_pairs
from tests.examples import examples


class Air:
    """Control slots over a fixed graph; each link loses at random, but never more than N^D frames in a row."""

    def __init__(self, size, edges, losses=0, rng=None, epochs=None, join_delay=0):
        self.nodes = [Discovery(i, size, losses, (epochs or [0] * size)[i], join_delay) for i in range(size)]
        self.join_delay, self.inbox = join_delay, [[] for _ in range(size)]
        self.edges, self.losses, self.rng = edges, losses, rng or Random(0)
        self.lost_in_a_row = dict.fromkeys(edges, 0)
        self.sent = 0
        self.ended = {}                     # node -> (cycle, start cycle, epoch) of its last end

    def loses(self, link):
        lost = self.lost_in_a_row[link] < self.losses and self.rng.random() < 0.7
        self.lost_in_a_row[link] = self.lost_in_a_row[link] + 1 if lost else 0
        return lost

    def control_slot(self, sender, cycle):
        node, inbox = self.nodes[sender], self.inbox[sender]
        while inbox and (node.phase is not Phase.SILENT or inbox[0][2] < cycle - self.join_delay):
            node.hear(*inbox.pop(0))
        frame = node.frame_to_send(cycle)
        self.sent += frame is not None
        for receiver in range(len(self.nodes)):
            if frame and (sender, receiver) in self.edges and not self.loses((sender, receiver)):
                self.inbox[receiver].append((sender, frame, cycle))

    def run(self, cycles, triggers, first=0):
        """`triggers`: {cycle: nodes that see an event at its begin}."""
        for cycle in range(first, first + cycles):
            for node in triggers.get(cycle, ()):
                self.nodes[node].trigger(cycle)
            for sender in range(len(self.nodes)):
                self.control_slot(sender, cycle)
            for i, node in enumerate(self.nodes):
                if node.is_running and cycle == node.end_cycle - 1:
                    self.ended[i] = (cycle + 1, node.start_cycle, node.epoch)
        for node, inbox in zip(self.nodes, self.inbox, strict=True):
            while inbox:
                node.hear(*inbox.pop(0))
        return [node.finish(first + cycles) for node in self.nodes]


def strongly_connected(rng, size):
    """A random cycle through all nodes, or two cycles that share a node, and some links more."""
    order = rng.sample(range(size), size)
    edges = {(a, b) for a, b in zip(order, order[1:] + order[:1], strict=True) if a != b}
    cut = rng.randrange(size)
    if rng.random() < 0.5 and 1 < cut < size - 1:
        edges = {(order[k], order[k + 1]) for k in range(size - 1)} | {(order[cut], order[0]), (order[-1], order[cut])}
    pairs = [(i, j) for i, j in product(range(size), repeat=2) if i != j]
    return edges | set(rng.sample(pairs, rng.randrange(len(pairs) // 3 + 1)))


@settings(max_examples=examples(150), deadline=None)
@given(st.integers(2, 8), st.integers(0, 2), st.integers(1, 3), st.integers(0, 2**32), st.sampled_from([0, 0, 1]))
@example(8, 2, 3, 0, 0)
def test_every_node_ends_with_the_same_true_laplacian_at_the_same_cycle(size, losses, initiators, seed, join_delay):
    rng = Random(seed)
    edges = strongly_connected(rng, size)
    air = Air(size, edges, losses, rng, join_delay=join_delay)
    triggers = {}
    for _ in range(initiators):             # later ones may still be unaware of the first, at most N - 1 links away
        triggers.setdefault(5 + rng.randrange(size), []).append(rng.randrange(size))

    outcomes = air.run(5 + size + cycles_needed(size, losses, join_delay), triggers)

    assert all(isinstance(outcome, Topology) for outcome in outcomes), outcomes
    assert all(np.array_equal(outcome.laplacian, laplacian(size, edges)) for outcome in outcomes)
    assert len(air.ended) == size
    assert len(set(air.ended.values())) == 1
    end, start, epoch = air.ended[0]
    assert (end, start, epoch) == (start + cycles_needed(size, losses, join_delay), min(triggers), 1)


def worst_case(size, losses):
    """A cycle against the order of the slots, where each frame needs a cycle per link, that loses all it may."""
    edges = {(i, (i - 1) % size) for i in range(size)}
    air = Air(size, edges, losses)
    air.rng.random = lambda: 0.0
    return air, edges


@pytest.mark.parametrize(("size", "losses"), [(2, 0), (3, 1), (5, 0), (5, 2), (8, 1)])
def test_the_bound_is_met_when_every_link_loses_all_it_may(size, losses):
    air, edges = worst_case(size, losses)

    outcomes = air.run(cycles_needed(size, losses), {0: [0]})

    assert all(np.array_equal(outcome.laplacian, laplacian(size, edges)) for outcome in outcomes)


@pytest.mark.parametrize("size", [3, 5, 8])
def test_the_bound_is_tight_up_to_one_link(size):
    """Around the cycle from the last node, 2 N - 1 links bring news one after the other, R cycles each; only that from
    node 0 to node N - 1 leads to a later slot of the same cycle and saves one cycle."""
    losses = 2
    air, _ = worst_case(size, losses)
    last_news = 0
    known = [list(node.records) for node in air.nodes]
    air.nodes[-1].trigger(0)
    for cycle in range(cycles_needed(size, losses)):
        for sender in range(size):
            air.control_slot(sender, cycle)
        now_known = [list(node.records) for node in air.nodes]
        if now_known != known:
            known, last_news = now_known, cycle

    assert last_news >= cycles_needed(size, losses) - 1 - (losses + 1)


@pytest.mark.parametrize("size", [2, 3])
def test_every_graph_of_two_or_three_nodes(size):
    """Exhaustively: the truth where it is strongly connected, and nobody believes to know it where it is not."""
    pairs = [(i, j) for i, j in product(range(size), repeat=2) if i != j]
    for chosen in product([False, True], repeat=len(pairs)):
        edges = {pair for pair, used in zip(pairs, chosen, strict=True) if used}
        L = laplacian(size, edges)

        outcomes = Air(size, edges).run(cycles_needed(size, 0), {0: range(size)})

        for outcome in outcomes:
            assert isinstance(outcome, Topology) == (not unreachable_pairs(L))
            if isinstance(outcome, Topology):
                assert np.array_equal(outcome.laplacian, L)


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(2, 8), st.integers(0, 2**32))
def test_without_strong_connection_no_node_takes_the_graph_for_complete(size, seed):
    rng = Random(seed)
    pairs = [(i, j) for i, j in product(range(size), repeat=2) if i != j]
    edges = set(rng.sample(pairs, rng.randrange(len(pairs) // 2 + 1)))
    if not unreachable_pairs(laplacian(size, edges)):
        return

    outcomes = Air(size, edges).run(cycles_needed(size, 0), {0: range(size)})

    assert all(isinstance(outcome, Incomplete) for outcome in outcomes)
    for node, outcome in enumerate(outcomes):
        assert outcome.heard_by[node] == tuple(sorted(i for i, j in edges if j == node))
        assert "Assumption 7" in str(outcome)
        assert outcome.cut_off


def test_a_node_that_only_listens_is_named_by_all_who_cannot_hear_it():
    """0 and 1 hear each other; 2 hears 1 and is heard by nobody."""
    outcomes = Air(3, {(0, 1), (1, 0), (1, 2)}).run(cycles_needed(3, 0), {0: [0]})

    assert [outcome.missing for outcome in outcomes] == [(2,), (2,), ()]
    assert str(outcomes[0]).startswith("no record of node 3")
    assert outcomes[2].cut_off == ((2, 0), (2, 1))
    assert str(outcomes[2]).startswith("no path from node 3 to node 1")


def test_control_slots_are_silent_before_an_event_and_after_the_end(l1):
    edges = {(j, i) for i, j in product(range(5), repeat=2) if i != j and l1[i, j]}
    air = Air(5, edges)
    with pytest.raises(RuntimeError, match="no discovery has ended by cycle 50"):
        air.run(50, {})
    assert air.sent == 0

    outcomes = air.run(30, {50: [2]}, first=50)
    sent = air.sent

    assert all(np.array_equal(outcome.laplacian, l1) for outcome in outcomes)
    assert sent <= 5 * cycles_needed(5, 0)
    air.run(20, {}, first=80)
    assert air.sent == sent


def test_a_second_discovery_forgets_links_that_are_gone(l1, l2):
    def links(L):
        return {(j, i) for i, j in product(range(5), repeat=2) if i != j and L[i, j]}

    air = Air(5, links(l1))
    air.run(20, {0: [0]})
    air.edges = links(l2)

    outcomes = air.run(20, {20: [3]}, first=20)

    assert all(np.array_equal(outcome.laplacian, l2) for outcome in outcomes)
    assert {node.epoch for node in air.nodes} == {2}


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(2, 6), st.integers(0, 1), st.integers(0, 2**32))
@example(2, 0, 65535)
def test_nodes_that_disagree_on_the_epoch_still_end_together(size, losses, seed):
    """After a restart: whoever hears an epoch that it has left behind starts a newer one."""
    rng = Random(seed)
    edges = strongly_connected(rng, size)
    epochs = [rng.choice([0, 1, 7, 20_000]) for _ in range(size)]
    air = Air(size, edges, losses, rng, epochs)

    outcomes = air.run(4 * cycles_needed(size, losses), {3: [rng.randrange(size)]})

    assert all(np.array_equal(outcome.laplacian, laplacian(size, edges)) for outcome in outcomes)
    assert len(set(air.ended.values())) == 1


@pytest.mark.parametrize(("older", "newer"), [(0, 1), (65_535, 0), (65_000, 2), (5, 32_772), (5, 32_773)])
def test_epochs_are_compared_modulo_65536_and_two_that_differ_by_anything_meet_again(older, newer):
    air = Air(2, {(0, 1), (1, 0)}, epochs=[older, newer])

    air.run(20, {0: [1]})

    assert air.nodes[0].epoch == air.nodes[1].epoch


def state(node):
    return node.phase, node.epoch, node.start_cycle, list(node.records), node.outcome


@given(st.binary(max_size=80), st.integers(-1, 9), st.sampled_from(list(Phase)))
@settings(deadline=None)
def test_random_bytes_change_nothing_but_the_count_of_refused_frames(data, sender, phase):
    node = Discovery(1, 5)
    if phase is not Phase.SILENT:
        node.trigger(3)
    if phase is Phase.RUNNING:
        node.frame_to_send(3)
    before = state(node)

    assert node.hear(sender, data, 4) is False

    assert state(node) == before
    assert node.refused == 1


@given(st.data())
@settings(deadline=None)
def test_a_damaged_frame_never_raises(data):
    sent = bytearray(DiscoveryFrame(2, 1, 3, (2, 4, 8, 16, 1)).encode())
    place = data.draw(st.integers(0, len(sent) - 1))
    sent[place] = data.draw(st.integers(0, 255))

    Discovery(1, 5).hear(2, bytes(sent[:data.draw(st.integers(0, len(sent)))]), 4)


@pytest.mark.parametrize(("frame", "sender"), [
    (DiscoveryFrame(2, 1, 4, (0,) * 5), 3),             # from another than its slot's owner
    (DiscoveryFrame(1, 1, 4, (0,) * 5), 1),             # one's own
    (DiscoveryFrame(2, 1, 5, (0,) * 5), 2),             # starts in the future
    (DiscoveryFrame(2, 1, 4, (0,) * 4), 2),             # among four nodes
    (DiscoveryFrame(2, 1, 0, (0,) * 5), 2),             # ended long ago
], ids=["wrong slot", "own", "future", "other team", "over"])
def test_a_frame_that_cannot_be_is_refused(frame, sender):
    node = Discovery(1, 5)
    cycle = 4 if frame.start_cycle else cycles_needed(5, 0)
    before = state(node)

    assert not node.hear(sender, frame.encode(), cycle)

    assert state(node) == before
    assert node.refused == 1


def test_nobody_can_tell_a_node_whom_it_hears_itself():
    node = Discovery(1, 3)

    node.hear(0, DiscoveryFrame(0, 1, 0, (0, 0b101, 0)).encode(), 0)

    assert node.records == [0, 0b001, 0]


def test_an_event_while_discovery_runs_does_not_start_it_anew():
    node = Discovery(0, 2)
    node.trigger(0)
    first = node.frame_to_send(0)

    node.trigger(1)

    assert node.is_running
    assert node.frame_to_send(1) == first


@pytest.mark.parametrize(("arguments", "said"), [
    ((0, MAX_NODES + 1), "size=17: expected 2 to 16, what fits a frame of 60 bytes"), ((0, 1), "size=1"),
    ((5, 5), "node=5: nodes are numbered 0 to 4"), ((-1, 5), "node=-1"), ((0, 5, -1), "max_successive_losses=-1"),
    ((0, 5, 0, 65_536), "epoch=65536: expected 0 to 65535")])
def test_a_node_that_cannot_be_is_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        Discovery(*arguments)


def heard_all():
    """Node 0 of two in the last cycle of an epoch in which it heard node 1."""
    node, other = Discovery(0, 2), Discovery(1, 2)
    node.trigger(0)
    for cycle in range(node.cycles):
        frame = node.frame_to_send(cycle)
        other.hear(0, frame, cycle)
        node.hear(1, other.frame_to_send(cycle), cycle)
    return node


ENTRIES = {
    "trigger": lambda node, cycle: node.trigger(cycle),
    "frame_to_send": lambda node, cycle: node.frame_to_send(cycle),
    "hear": lambda node, cycle: node.hear(1, b"no frame", cycle),
    "finish": lambda node, cycle: node.finish(cycle),
}


@pytest.mark.parametrize("entry", ENTRIES)
def test_an_epoch_is_over_at_its_end_cycle_whatever_is_asked_first(entry):
    node = heard_all()
    assert node.is_running

    ENTRIES[entry](node, node.end_cycle)

    assert node.phase is (Phase.ARMED if entry == "trigger" else Phase.SILENT)
    assert isinstance(node.outcome, Topology)


@pytest.mark.parametrize("entry", ["trigger", "frame_to_send", "hear"])
def test_an_epoch_runs_through_its_last_cycle(entry):
    node = heard_all()

    ENTRIES[entry](node, node.end_cycle - 1)

    assert node.is_running
    assert node.outcome is None
    with pytest.raises(RuntimeError, match=r"no discovery has ended by cycle 2 \(RUNNING, end_cycle=3\)"):
        node.finish(node.end_cycle - 1)
