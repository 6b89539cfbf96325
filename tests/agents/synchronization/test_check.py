import numpy as np
import pytest

from agents.synchronization.check import problems
from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.graph import laplacian

NAMES = ["ada", "bob", "cid"]


@pytest.fixture
def tame():
    return [LinearAgent([[-1.0]], [[1.0]], [[1.0]], [[1.0]])] * 3


def ring(size=3):
    return laplacian(size, [(i, (i + 1) % size) for i in range(size)])


def test_nothing_is_wrong_with_the_example(five_agents, l1, l2):
    for L in (l1, l2):
        assert problems(five_agents, L, slot_ns=870_203, airtime_ns=870_203, delay_ns=500_000) == []


def test_a_one_way_link_without_a_cycle_is_named_with_assumption_7(tame):
    found = problems(tame, laplacian(3, [(0, 1), (1, 2), (2, 1)]), names=NAMES)

    assert found[0].startswith("the one-way link ada -> bob lies on no cycle (Assumption 7): nothing leads from bob")
    assert "no path leads from cid to ada" in found[1]
    assert len(found) == 2


def test_a_graph_in_two_pieces_is_not_strongly_connected(tame):
    found = problems([*tame, tame[0]], laplacian(4, [(0, 1), (1, 0), (2, 3), (3, 2)]))

    assert found == ["no path leads from agent 0 to agent 2 (8 such pairs): discovery needs a strongly connected graph "
                     "(section 6.3.1)"]


def test_a_leader_is_welcome_where_the_topology_is_told(tame):
    assert problems(tame, laplacian(3, [(0, 1), (1, 2)]), discovered=False) == []


def test_a_closed_loop_that_is_not_hurwitz_is_named_with_its_eigenvalue(tame):
    pushing = LinearAgent([[1.0]], [[1.0]], [[1.0]], [[-1.0]])

    found = problems([pushing, *tame[:2]], ring())

    assert len(found) == 1
    worst = np.linalg.eigvals([[2.0, 0, -1], [1, -2, 0], [0, 1, -2]]).real.max()    # A_cl by hand
    assert f"A_cl is not Hurwitz (Assumption 6): it has the eigenvalue {worst:.6g};" in found[0]


def test_an_eigenvalue_pair_is_printed_as_a_complex_number(tame):
    spinning = LinearAgent([[0.0, 1.0], [-1.0, 0.5]], [[0.0], [1.0]], [[0.0, 0.0]], [[1.0]])

    found = problems([spinning, *tame[:2]], ring())

    assert "eigenvalue 0.25 +0.968246j" in found[0] or "eigenvalue 0.25 -0.968246j" in found[0]


def test_a_slot_shorter_than_its_frames_is_named_with_both_numbers(five_agents, l1):
    found = problems(five_agents, l1, slot_ns=1_000_000, airtime_ns=1_000_001)

    assert len(found) == 1
    assert found[0].startswith("a slot of 1 ms is shorter than its frames, 1.000001 ms")
    assert "(6.20)" in found[0]


def test_a_slot_beyond_the_exact_limit_is_refused_with_the_spectral_radius(five_agents, l1):
    found = problems(five_agents, l1, slot_ns=9_900_000)        # the limit is 9.8366 ms

    assert len(found) == 1
    assert "spectral radius 1.01" in found[0]
    assert problems(five_agents, l1, slot_ns=9_800_000) == []


def test_all_problems_come_at_once(five_agents):
    agents = [LinearAgent([[1.0]], [[1.0]], [[1.0]], [[-1.0]])] * 3

    found = problems(agents, laplacian(3, [(0, 1)]), slot_ns=10, airtime_ns=20)

    assert [key for key in ("Assumption 7", "strongly connected", "Assumption 6", "shorter") if
            not any(key in problem for problem in found)] == []


@pytest.mark.parametrize(("matrix", "said"), [
    ([[1.0]], "expected the number of agents that 0 hears, 0"), ([[0.0, 0.0]], "expected N x N"),
    (ring(4), "3 agents and a Laplacian of 4")])
def test_a_matrix_that_is_no_graph_of_this_team_is_one_problem(tame, matrix, said):
    found = problems(tame, np.array(matrix))

    assert len(found) == 1
    assert said in found[0]
