import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.synchronization import graph
from agents.synchronization.graph import GraphError

L1_EDGES = [(1, 0), (3, 0), (2, 1), (4, 2), (0, 3), (1, 3), (2, 4), (3, 4)]     # sender, receiver; read off (6.15)


@st.composite
def edge_sets(draw, max_size=7):
    size = draw(st.integers(1, max_size))
    pairs = [(i, j) for i in range(size) for j in range(size) if i != j]
    return size, draw(st.sets(st.sampled_from(pairs))) if pairs else set()


def as_networkx(size, edges):
    G = nx.DiGraph()
    G.add_nodes_from(range(size))
    G.add_edges_from(edges)
    return G


def test_the_edges_of_figure_6_1_give_the_printed_laplacian(l1):
    assert np.array_equal(graph.laplacian(5, L1_EDGES), l1)


def test_the_neighbours_of_an_agent_are_those_that_it_hears(l1):
    assert graph.neighbours(l1) == [[1, 3], [2], [4], [0, 1], [2, 3]]
    assert graph.neighbours(l1.T) == [[3], [0, 3], [1, 4], [0, 4], [2]]


@given(edge_sets())
def test_edges_and_laplacian_determine_each_other(case):
    size, edges = case

    L = graph.laplacian(size, edges)

    assert set(graph.edges(L)) == edges
    assert np.array_equal(graph.laplacian_from_neighbours(graph.neighbours(L)), L)
    assert graph.laplacian_problems(L) == []
    assert np.array_equal(L @ np.ones(size), np.zeros(size))


@given(edge_sets())
def test_connection_distances_and_cycles_agree_with_networkx(case):
    size, edges = case
    G, L = as_networkx(size, edges), graph.laplacian(size, edges)
    lengths = dict(nx.all_pairs_shortest_path_length(G))

    one_way = graph.one_way_links_without_cycle(L)

    assert (not graph.unreachable_pairs(L)) == nx.is_strongly_connected(G)
    assert [[lengths[i].get(j, np.inf) for j in range(size)] for i in range(size)] == graph.distances(L).tolist()
    components = {node: k for k, members in enumerate(nx.strongly_connected_components(G)) for node in members}
    assert set(one_way) == {(i, j) for i, j in edges if components[i] != components[j]}
    if nx.is_strongly_connected(G):
        assert graph.distances(L).max() == (nx.diameter(G) if size > 1 else 0)


def test_both_topologies_of_the_example_satisfy_assumption_7(l1, l2):
    assert graph.one_way_links_without_cycle(l1) == graph.one_way_links_without_cycle(l2) == []


def test_the_longest_way_in_both_topologies_leads_from_agent_1_over_4_5_3_to_2(l1, l2):
    assert graph.distances(l1).max() == graph.distances(l1)[0, 1] == 4
    assert graph.distances(l2).max() == graph.distances(l2)[0, 1] == 4


def test_a_leader_that_hears_nobody_breaks_assumption_7():
    leader_follower = graph.laplacian(3, [(0, 1), (1, 2), (2, 1)])

    assert graph.one_way_links_without_cycle(leader_follower) == [(0, 1)]
    assert graph.unreachable_pairs(leader_follower) == [(1, 0), (2, 0)]


@pytest.mark.parametrize(("matrix", "said"), [
    ([[1, -1], [0, 1]], r"l\[1\]\[1\]=1: expected the number of agents that 1 hears, 0"),
    ([[2, -2], [-1, 1]], r"l\[0\]\[1\]=-2: expected -1 \(0 hears 1\) or 0"),
    ([[0.5, -0.5], [0, 0]], r"l\[0\]\[1\]=-0.5"),
    ([[float("nan")]], r"l\[0\]\[0\]=nan"),
    ([[0, 0]], r"shape \(1, 2\): expected N x N"),
    ([[0, 0], [0]], "not a matrix of numbers"),
    ("graph", "not a matrix of numbers"),
    ([], "shape"),
])
def test_a_matrix_that_is_no_laplacian_is_refused_with_the_entry_and_the_rule(matrix, said):
    with pytest.raises(GraphError, match=said):
        graph.checked_laplacian(matrix)


@pytest.mark.parametrize(("edge", "said"), [((0, 3), "numbered 0 to 2"), ((-1, 0), "numbered 0 to 2"),
                                            ((1, 1), "no link to itself")])
def test_an_edge_that_cannot_be_is_refused(edge, said):
    with pytest.raises(GraphError, match=said):
        graph.laplacian(3, [edge])
