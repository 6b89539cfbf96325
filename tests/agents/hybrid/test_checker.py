"""The checker on executions that are right, and on each way to be wrong."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.hybrid import mode_change
from agents.hybrid.automaton import Automaton, Edge, Mode
from agents.hybrid.checker import Rule, Samples, check
from agents.hybrid.mode_change import ModeChange
from agents.hybrid.network import Contacts, Network, graphs, missing_contacts
from agents.hybrid.region import EVERYWHERE, All, AnyOf, Between, Where

S = 10**9
INSIDE = All(Between("x", 0, 10), Between("y", 0, 10))
# An evader of (2.3): it turns every T_min = 2 s or later into a heading delta, and is captured where it is.
EVADER = Automaton(
    modes={"active": Mode(INSIDE, {"x": (-1.0, 1.0), "y": (-1.0, 1.0)}), "captured": Mode(rates={"x": (0.0, 0.0)})},
    edges=[Edge("active", "active", Between("delta", -pi / 2, pi / 2), {"theta": "delta"}, apart_ns=2 * S),
           Edge("active", "captured", Between("x", 1, 10))],
    initial={"active": AnyOf(Between("x", 0, 0), Between("y", 0, 0))},
    variables={"x": "m", "y": "m", "theta": "rad"}, inputs={"delta": "rad"})
AT_START = {"x": 0.0, "y": 5.0, "theta": 0.0}


def start(**state):
    return ModeChange(0, "t1", "", "active", AT_START | state, AT_START | state, cause="start")


def turn(at_s, delta=0.5, **state):
    state = {"x": 2.0, "y": 5.0, "theta": 0.0} | state
    return ModeChange(round(at_s * S), "t1", "active", "active", state, state | {"theta": delta}, {"delta": delta},
                      cause="turn")


def capture(at_s, **state):
    state = {"x": 4.0, "y": 5.0, "theta": 0.5} | state
    return ModeChange(round(at_s * S), "t1", "active", "captured", state, state, by="p1", cause="in reach")


RIGHT = (start(), turn(2.5), turn(4.5), capture(5))


def rules(*changes, samples=None, dead_ns=()):
    return [(refusal.rule, refusal.from_ns / S) for refusal in check("t1", EVADER, changes, samples, dead_ns)]


def test_an_execution_of_the_automaton_is_taken():
    assert rules(*RIGHT) == []


@pytest.mark.parametrize(("changes", "refused"), [
    ((start(x=1.0, y=5.0), capture(5)), (Rule.START, 0)),                                  # not on the boundary
    ((replace(start(), after="captured"),), (Rule.START, 0)),                               # no initial mode
    ((replace(start(y=11.0)),), (Rule.START, 0)),                                           # in Init, outside Dom
    (RIGHT[1:], (Rule.START, 2.5)),
    ((start(), turn(4.5), turn(2.5), capture(5)), (Rule.ORDER, 2.5)),                       # time runs backwards
    ((*RIGHT, turn(7)), (Rule.ORDER, 7)),                                                   # it was captured
    ((*RIGHT[:3], replace(capture(5), after="active", by="")), (Rule.GUARD, 5)),            # delta was not recorded
    ((*RIGHT, replace(turn(7), before="captured")), (Rule.EDGE, 7)),
    ((start(), turn(3, delta=2.0)), (Rule.GUARD, 3)),
    ((start(), capture(5, x=0.5)), (Rule.GUARD, 5)),
    ((start(), replace(turn(3), reached={"x": 2.0, "y": 5.0, "theta": 0.4})), (Rule.RESET, 3)),
    ((start(), replace(turn(3), reached={"x": 2.1, "y": 5.0, "theta": 0.5})), (Rule.RESET, 3)),      # a jump in x
    ((start(), turn(3, y=11.0)), (Rule.DOMAIN, 3)),
    ((start(), turn(1.9)), (Rule.APART, 1.9)),
    ((start(), turn(2.5), turn(4.499)), (Rule.APART, 4.499)),
    ((start(), start(x=0.0)), (Rule.START, 0)),                                             # it was not dead
    ((start(), replace(turn(3), state={"x": 1.0})), (Rule.UNREADABLE, 3)),
    ((), (Rule.START, 0)),
])
def test_another_execution_is_refused_by_its_rule_and_instant(changes, refused):
    assert refused in rules(*changes)


def test_after_its_death_an_execution_starts_again_and_gaps_count_from_there():
    again = replace(start(), time_ns=6 * S)

    assert rules(start(), turn(2.5), again, turn(8), dead_ns=[(3 * S, 6 * S)]) == []
    assert rules(start(), turn(2.5), again, turn(7.9), dead_ns=[(3 * S, 6 * S)]) == [(Rule.APART, 7.9)]


def sampled(**columns):
    names = tuple(columns)
    values = np.array([columns[name] for name in names], dtype=float).T
    return Samples(names, np.arange(len(values), dtype=np.int64) * S, values)


def test_samples_outside_the_domain_are_one_stretch():
    # the automaton is active up to 5 s; from 5 s on the domain is everywhere, but x may not change
    samples = sampled(x=[0, 1, 2, 2.5, 3, 4, 4, 4], y=[9.5, 9.6, 10.5, 10.2, 9.9, 9.5, 9, 9])

    found = check("t1", EVADER, RIGHT, samples)

    assert [(each.rule, each.from_ns, each.until_ns) for each in found] == [(Rule.DOMAIN, 2 * S, 4 * S)]
    assert "y=10.5" in found[0].what


def test_a_rate_is_judged_between_samples_in_one_mode_only():
    # 1.2 m/s from 1 s to 2 s; from 2 s to 3 s and 4 s to 5 s changes of mode lie between; moved when captured, 6 to 7 s
    samples = sampled(x=[0, 1, 2.2, 4, 4.5, 6, 6, 6.5], y=[5] * 8)

    assert rules(*RIGHT, samples=samples) == [(Rule.RATE, 1), (Rule.RATE, 6)]


def test_samples_of_a_dead_node_and_signals_that_are_not_recorded_are_not_judged():
    dead = [(3 * S, 6 * S)]
    changes = start(), replace(start(), time_ns=6 * S)
    samples = sampled(y=[5, 5, 5, np.nan, 99, np.nan, 5, 5])

    assert rules(*changes, samples=samples, dead_ns=dead) == []
    assert (Rule.DOMAIN, 3) in rules(start(), samples=samples)      # nan is in no interval


@given(st.dictionaries(st.sampled_from(["x", "y-1", "theta_p"]), st.floats(allow_nan=False), max_size=3),
       st.dictionaries(st.sampled_from(["x", "y-1", "theta_p"]), st.floats(allow_nan=False), max_size=3),
       st.dictionaries(st.sampled_from(["delta"]), st.floats(allow_nan=False)),
       st.sampled_from(["", "r2"]), st.text(st.characters(codec="utf-8")), st.sampled_from(["", "sensing"]))
def test_what_is_written_into_an_event_reads_back_exactly(state, reached, inputs, by, cause, before):
    change = ModeChange(7, "r1", before, "mobile-sensing", state, reached, inputs, by, cause)

    assert mode_change.read(7, "r1", change.detail()) == change


@pytest.mark.parametrize("detail", ["", "sensing", "a -> b", "a -> b at x=: c", "a -> b at x: c", "-> b at x=1 by : c"])
def test_another_text_is_no_change_of_mode(detail):
    assert mode_change.read(0, "r1", detail) is None


@pytest.mark.parametrize(("changed", "said"), [
    ({"edges": [Edge("active", "lost")]}, "'lost' is no mode"),
    ({"edges": [Edge("active", "active"), Edge("active", "active")]}, "two edges"),
    ({"edges": [Edge("active", "active", Between("z"))]}, "'z' is neither a variable nor an input"),
    ({"edges": [Edge("active", "active", reset={"delta": 0.0})]}, "'delta' is no variable"),
    ({"edges": [Edge("active", "active", reset={"x": "z"})]}, "'z' is neither"),
    ({"edges": [Edge("active", "active", apart_ns=-1)]}, "apart_ns=-1"),
    ({"initial": {}}, "at least one mode"),
    ({"initial": {"active": Between("delta")}}, "'delta' is no variable"),
    ({"modes": {"active": Mode(), "not a name": Mode()}, "edges": []}, "letters, digits"),
    ({"inputs": {"x": "m", "delta": "rad"}}, "a variable and an input"),
])
def test_an_automaton_that_contradicts_itself_is_refused(changed, said):
    with pytest.raises(ValueError, match=said):
        replace(EVADER, **changed)


def test_regions_say_what_they_are():
    region = All(INSIDE, Where("left of the wall", ("x",), lambda point: point["x"] < 3), Between("y", least=1))

    assert str(region) == "0 <= x <= 10 and 0 <= y <= 10 and left of the wall and 1 <= y"
    assert region.variables == {"x", "y"}
    assert [region.holds({"x": x, "y": 2}) for x in (2.9, 3, float("nan"))] == [True, False, False]
    assert EVERYWHERE.holds({})
    with pytest.raises(ValueError, match="expected least <= most"):
        Between("x", 1, 0)


HEARD = Contacts({("a", "b"): np.array([5, 20]), ("b", "c"): np.array([12])}, {("t", "a"): np.array([7])})


def changed(at_ns, node, by):
    return ModeChange(at_ns, node, "x", "y", {}, {}, by=by)


def test_a_cause_has_to_have_been_heard_or_seen_before():
    changes = [changed(5, "b", "a"), changed(4, "b", "a"), changed(30, "b", "a"), changed(31, "b", "a"),
               changed(7, "a", "t"), changed(9, "t", "a"), changed(3, "c", ""), changed(3, "c", "c")]

    found = [(refusal.node, refusal.from_ns) for refusal in missing_contacts(changes, HEARD, within_ns=11)]

    assert found == [("b", 4), ("b", 31), ("t", 9)]     # (20, 31] has no frame of a; a did not show itself to t


def test_graphs_are_those_of_each_interval():
    network = Network(tuple("abct"), dict.fromkeys("abct", EVADER), frozenset({("a", "b")}))

    found = list(graphs(network, HEARD, [changed(8, "a", "t"), changed(15, "c", "a")], 10, 25))

    assert [(each.from_ns, each.until_ns) for each in found] == [(0, 10), (10, 20), (20, 25)]
    assert [set(each.communication.edges) for each in found] == [{("a", "b")}, {("b", "c")}, {("a", "b")}]
    assert [set(each.sensing.edges) for each in found] == [{("t", "a")}, set(), set()]
    assert [set(each.control.edges) for each in found] == [{("a", "b"), ("t", "a")}, {("a", "b"), ("a", "c")},
                                                           {("a", "b")}]
    assert [each.unsupported() for each in found] == [[], [("a", "b"), ("a", "c")], []]
    assert all(set(each.control.nodes) == set("abct") for each in found)
    assert network.uniform
    assert not Network(("a", "b"), {"a": EVADER, "b": replace(EVADER, edges=[])}).uniform
    with pytest.raises(ValueError, match="expected nodes of the network"):
        Network(("a",), {"a": EVADER}, frozenset({("a", "z")}))
