import pytest

from netem.topology import Site, TopologyError
from netem.topology.path_loss import PathLoss

SITE = Site(("base", "rover"), {"base": (0.0, 0.0)}, 0.0, -85.0)       # range 177.8 m


def follow(**settings):
    return PathLoss("positions", bodies={"rover": ("x", "y")}, **settings).over(SITE)


def test_the_last_position_shown_decides():
    graph = follow()
    for t_ns, x_m, heard in ((0, 0.0, True), (10, 177.0, True), (20, 178.0, False), (30, 177.0, True)):
        graph.show("rover", (x_m, 0.0), t_ns)

        assert ("base" in graph.reach_at("rover", t_ns).in_range) is heard
        assert ("rover" in graph.reach_at("base", t_ns + 9).in_range) is heard


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
