from itertools import combinations

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from agents.synchronization.graph import laplacian
from agents.synchronization.partition import colliding_pairs, partition


@st.composite
def graphs(draw):
    """(size, edges) of any directed graph of up to 7 agents."""
    size = draw(st.integers(1, 7))
    pairs = [(i, j) for i in range(size) for j in range(size) if i != j]
    return size, draw(st.sets(st.sampled_from(pairs))) if pairs else set()


def collide(edges, i, j):
    """The radio network model, from the edges alone."""
    heard_by = [{receiver for sender, receiver in edges if sender == agent} for agent in (i, j)]
    return i in heard_by[1] or j in heard_by[0] or bool(heard_by[0] & heard_by[1])


def greedy(size, edges):
    """An agent without a part opens one and takes in, in order, all without one that collide with nobody in it."""
    left, parts = list(range(size)), []
    while left:
        part = []
        for agent in list(left):
            if not any(collide(edges, agent, member) for member in part):
                part.append(agent)
                left.remove(agent)
        parts.append(tuple(part))
    return tuple(parts)


def test_the_printed_partitions(l1, l2):
    assert partition(l1) == ((0, 2), (1, 4), (3,))
    assert partition(l2) == ((0, 2), (1, 3), (4,))


@given(graphs())
def test_every_agent_is_in_one_part_and_no_part_collides(case):
    size, edges = case

    parts = partition(laplacian(size, edges))

    assert sorted(agent for part in parts for agent in part) == list(range(size))
    assert not any(collide(edges, i, j) for part in parts for i, j in combinations(part, 2))


@given(graphs())
def test_the_parts_are_the_greedy_ones_of_the_radio_network_model(case):
    assert partition(laplacian(*case)) == greedy(*case)


@given(graphs(), st.integers(1, 7))
@example((3, {(0, 1)}), 3)
def test_colliding_pairs_are_found_in_any_grouping(case, width):
    size, edges = case
    parts = [tuple(range(size))[k:k + width] for k in range(0, size, width)]

    found = colliding_pairs(laplacian(size, edges), parts)

    assert set(found) == {(i, j) for part in parts for i, j in combinations(part, 2) if collide(edges, i, j)}


def test_the_printed_algorithm_would_put_an_agent_into_two_parts():
    """0 and 1 collide, 2 collides with nobody: line 7 as printed takes 2 into the part of 0 and into that of 1."""
    edges = {(0, 1), (1, 0)}

    assert partition(laplacian(3, edges)) == ((0, 2), (1,))


def test_when_all_hear_all_each_speaks_alone():
    L = 4 * np.eye(4) - np.ones((4, 4))

    assert partition(L) == ((0,), (1,), (2,), (3,))
