from random import Random

import pytest

from netem.topology import Site, TopologyError
from netem.topology.path_loss import PathLoss
from netem.topology.two_ray import TwoRay
from netem.topology.zones import Circle

SITE = Site(("base", "rover"), {"base": (0.0, 0.0)}, 0.0, -85.0)       # range 177.8 m


def follow(**settings):
    return PathLoss("positions", bodies={"rover": ("x", "y")}, **settings).over(SITE)


def test_the_last_position_shown_decides():
    graph = follow()
    for t_ns, x_m, heard in ((0, 0.0, True), (10, 177.0, True), (20, 178.0, False), (30, 177.0, True)):
        graph.show("rover", (x_m, 0.0), t_ns)

        assert ("base" in graph.reach_at("rover", t_ns).in_range) is heard
        assert ("rover" in graph.reach_at("base", t_ns + 9).in_range) is heard


def test_links_that_appear_and_disappear_are_compared_with_those_before():
    graph = follow()
    found = []
    for t_ns, x_m in ((0, 0.0), (10, 177.0), (20, 178.0), (30, 200.0), (40, 177.0)):
        graph.show("rover", (x_m, 0.0), t_ns)
        found.append(graph.compare(t_ns))

    both = [("base", "rover"), ("rover", "base")]
    assert found == [(both, []), ([], []), ([], both), ([], []), (both, [])]
    assert graph.changes_ns(40) == [20]                 # not what holds from the start
    assert graph.changes_ns(41) == [20, 40]


@pytest.mark.parametrize("law", [{}, {"exponent": 3.5, "reference_loss_db": 20.0}, {"exponent": 0.0},
                                 {"reference_loss_db": 90.0},       # nobody is ever in range
                                 {"zones": (Circle("circle", (0.0, 0.0), 50.0, 10.0),)},
                                 {"two_ray": TwoRay(antenna_height_m=0.5)}])
def test_no_change_is_missed_by_comparing_only_after_moves_that_can_change_a_link(law):
    """Robots on random walks about the edge of range; the oracle is the graph of robots that stand there."""
    rng, nodes = Random(3), ("a", "b", "c", "d")
    at_m = {node: (rng.uniform(-150.0, 150.0), rng.uniform(-150.0, 150.0)) for node in nodes}
    site = Site(nodes, {"d": at_m["d"]}, 0.0, -85.0)
    graph = PathLoss("positions", bodies=dict.fromkeys("abc", ("x", "y")), **law).over(site)
    links, compared, changes = set(), 0, 0
    for t_ns in range(3000):
        for node in "abc":
            at_m[node] = tuple(x + rng.uniform(-1.0, 1.0) for x in at_m[node])
        may_have_changed = [graph.show(node, at_m[node], t_ns) for node in "abc"]
        if any(may_have_changed):
            compared += 1
            appeared, disappeared = graph.compare(t_ns)
            assert not links & {*appeared}
            assert links >= {*disappeared}
            links = links - {*disappeared} | {*appeared}
            changes += bool(appeared or disappeared)
        standing = PathLoss("positions", **law).over(Site(nodes, dict(at_m), 0.0, -85.0))
        assert links == {*standing.graph_at(0)}

    if law in ({}, {"exponent": 3.5, "reference_loss_db": 20.0}):
        assert changes > 5
        assert compared < 1500
    elif "exponent" in law:
        assert compared == 1


def test_only_a_new_position_is_a_move():
    graph = follow()

    assert [graph.show("rover", (x_m, 0.0), t_ns) for t_ns, x_m in ((0, 0.0), (10, 0.0), (20, 1.0))] == [
        True, False, True]


def test_a_node_that_has_shown_nothing_reaches_nobody():
    graph = follow()

    assert graph.reach_at("rover", 0).receivers == graph.reach_at("base", 0).receivers == ()


def test_any_two_nodes_may_come_into_range():
    assert follow().moves
    assert follow().graph_at(0) == [("base", "rover"), ("rover", "base")]


@pytest.mark.parametrize(("settings", "says"), [
    ({"bodies": {"rover": ("x",)}}, "bodies of 'rover' names 1 outputs: expected 2 or 3, the same for all"),
    ({"bodies": {"rover": ("x", "y", "z")}}, "bodies of 'rover' names 3 outputs: expected 2 or 3, the same for all"),
    ({"bodies": {"rovr": ("x", "y")}}, "bodies names 'rovr', which has no port on this medium"),
    ({"bodies": {"rover": ("x", "y")}, "at_m": {"rover": (0.0, 0.0)}}, "at_m and bodies both say where 'rover' is"),
])
def test_mistakes_in_bodies_are_named(settings, says):
    with pytest.raises(TopologyError) as error:
        PathLoss("positions", **settings).over(SITE)

    assert says in str(error.value)


def test_a_pose_period_of_nothing_is_refused():
    with pytest.raises(ValueError, match="pose_period_ns=0: expected at least 1"):
        PathLoss("positions", pose_period_ns=0)
