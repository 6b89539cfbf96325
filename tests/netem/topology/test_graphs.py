import pytest

from netem.topology import Site, TopologyError
from netem.topology.fixed_graph import FixedGraph
from netem.topology.switching_graph import GraphChange, SwitchingGraph

NODES = ("a1", "a2", "b1")
SITE = Site(NODES, {}, tx_power_dbm=0.0, sensitivity_dbm=-90.0)


def edges(*links):
    return FixedGraph(links=links).over(SITE).graph_at(0)


def test_an_arrow_is_one_way_and_a_double_arrow_is_both():
    assert edges("a1 -> b1") == [("a1", "b1")]
    assert edges("a1 <-> b1") == [("a1", "b1"), ("b1", "a1")]


def test_wildcards_name_every_matching_node_but_nobody_hears_itself():
    assert edges("a* -> *") == [("a1", "a2"), ("a1", "b1"), ("a2", "a1"), ("a2", "b1")]
    assert len(edges("* -> *")) == len(edges("* <-> *")) == 6


def test_the_default_is_that_everybody_hears_everybody():
    assert len(FixedGraph().over(SITE).graph_at(0)) == 6


def test_a_graph_without_links_is_allowed():
    assert edges() == []


def test_receivers_come_in_the_order_of_the_nodes_whatever_the_order_of_the_links():
    topology = FixedGraph(links=("a1 -> b1", "a1 -> a2")).over(SITE)

    assert topology.reach_at("a1", 0).receivers == ("a2", "b1")


def test_a_later_level_overrules_an_earlier_one_and_levels_make_no_links():
    topology = FixedGraph(links=("a* -> b1",), levels_dbm={"* -> *": -70.0, "a2 -> b1": -95.0}).over(SITE)

    assert topology.reach_at("a1", 0).rx_dbm == {"b1": -70.0}
    assert topology.reach_at("a2", 0).rx_dbm == {"b1": -95.0}
    assert topology.reach_at("a2", 0).receivers == ("b1",)
    assert topology.reach_at("a2", 0).too_weak == {"b1"}
    assert topology.graph_at(0) == [("a1", "b1")]


def test_all_mistakes_in_links_are_reported_at_once():
    with pytest.raises(TopologyError) as error:
        edges("a1 -> b12", "a1 - b1", "z* -> q", "a1 -> a1", "-> b1", "a1 -> b1 -> a2")

    problems = str(error.value).splitlines()
    assert len(problems) == 7
    assert problems[0] == "link 'a1 -> b12': no node is called 'b12': did you mean 'b1'?"
    assert problems[1].endswith("expected 'sender -> receiver' or 'node <-> node'")
    assert "the nodes are a1, a2, b1" in problems[2]
    assert "joins no two different nodes" in problems[4]


def switching(*changes, repeat_ns=None, graphs=None):
    return SwitchingGraph("switching", graphs or {"one": ("a1 -> a2",), "two": ("a2 -> b1",)},
                          tuple(GraphChange(*change) for change in changes), repeat_ns)


def test_a_graph_holds_from_its_instant_to_the_next():
    topology = switching((0, "one"), (10, "two"), (30, "one")).over(SITE)

    assert [topology.graph_at(t)[0] for t in (0, 9, 10, 29, 30, 10**12)] == [
        ("a1", "a2"), ("a1", "a2"), ("a2", "b1"), ("a2", "b1"), ("a1", "a2"), ("a1", "a2")]
    assert topology.changes_ns(10**9) == [10, 30]
    assert topology.changes_ns(30) == [10]


def test_reach_is_a_function_of_time_whatever_was_asked_before():
    asked_in_order = switching((0, "one"), (10, "two"), repeat_ns=25).over(SITE)
    asked_back_and_forth = switching((0, "one"), (10, "two"), repeat_ns=25).over(SITE)

    instants = [(k * 37) % 113 for k in range(113)]
    assert [asked_back_and_forth.reach_at("a1", t).receivers for t in instants] == [
        dict(zip(sorted(instants), (asked_in_order.reach_at("a1", t).receivers for t in sorted(instants)),
                 strict=True))[t] for t in instants]
    assert all((asked_back_and_forth.reach_at("a1", t).receivers == ("a2",)) == (t % 25 < 10) for t in instants)


def test_a_repeated_schedule_changes_at_every_multiple():
    topology = switching((0, "one"), (10, "two"), repeat_ns=25).over(SITE)

    assert topology.changes_ns(76) == [10, 25, 35, 50, 60, 75]


def test_a_row_that_repeats_the_graph_before_is_no_change():
    topology = switching((0, "one"), (10, "two"), (20, "one"), repeat_ns=30).over(SITE)

    assert topology.changes_ns(61) == [10, 20, 40, 50]


@pytest.mark.parametrize(("changes", "repeat_ns", "message"), [
    ([(0, "ones")], None, r"schedule\[0\].graph='ones': no such graph: did you mean 'one'"),
    ([(5, "one")], None, "expected a first entry with at_ns = 0"),
    ([], None, "expected a first entry with at_ns = 0"),
    ([(0, "one"), (7, "two"), (7, "one")], None, r"schedule\[2\].at_ns=7: expected later than the one before \(7\)"),
    ([(0, "one"), (7, "two")], 7, r"repeat_ns=7: expected later than the last change \(7\)"),
])
def test_a_schedule_that_makes_no_sense_is_refused(changes, repeat_ns, message):
    with pytest.raises(TopologyError, match=message):
        switching(*changes, repeat_ns=repeat_ns).over(SITE)


def test_a_bad_link_names_its_graph():
    with pytest.raises(TopologyError, match=r"graphs\.one: link 'a1 -> x'"):
        switching((0, "one"), graphs={"one": ("a1 -> x",)}).over(SITE)
