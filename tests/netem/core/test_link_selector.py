from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.link_selector import LinkSelectorError, parse

NODES = {"radio": ["leader", "rover_1", "rover_2"], "can": ["leader", "arm"]}


@pytest.mark.parametrize(("text", "links"), [
    ("radio: leader -> rover_1", [("leader", "rover_1")]),
    ("radio:leader->rover_1", [("leader", "rover_1")]),
    ("  radio :  leader  ->  rover_1 ", [("leader", "rover_1")]),
    ("radio: leader <-> rover_1", [("leader", "rover_1"), ("rover_1", "leader")]),
    ("radio:leader<->rover_1", [("leader", "rover_1"), ("rover_1", "leader")]),
    ("radio: leader -> *", [("leader", "rover_1"), ("leader", "rover_2")]),
    ("radio: * -> leader", [("rover_1", "leader"), ("rover_2", "leader")]),
    ("radio: rover_? -> rover_[12]", [("rover_1", "rover_2"), ("rover_2", "rover_1")]),
])
def test_a_text_means_these_links(text, links):
    assert parse(text).resolve(NODES) == [("radio", *link) for link in links]


@pytest.mark.parametrize(("text", "links"), [
    ("radio: leader -> leader", [("leader", "leader")]),
    ("radio: * -> leader", [("leader", "leader"), ("rover_1", "leader"), ("rover_2", "leader")]),
    ("radio: rover_1 -> *", [("rover_1", "leader"), ("rover_1", "rover_2")]),
])
def test_a_node_that_a_medium_shows_to_itself_has_a_link_to_itself(text, links):
    assert parse(text).resolve(NODES, {"radio": ["leader"]}) == [("radio", *link) for link in links]


def test_all_links_of_all_media():
    links = parse("*: * <-> *").resolve(NODES)

    assert links == list(dict.fromkeys(links))
    assert set(links) == {(medium, a, b) for medium, nodes in NODES.items() for a in nodes for b in nodes if a != b}


def test_media_of_a_pattern_without_such_nodes_are_passed_over():
    assert parse("*: leader -> arm").resolve(NODES) == [("can", "leader", "arm")]


def test_a_name_that_exists_is_no_pattern():
    assert parse("radio: [1] -> 1").resolve({"radio": ["[1]", "1"]}) == [("radio", "[1]", "1")]


@pytest.mark.parametrize(("text", "message"), [
    ("leader -> rover_1", 'expected "medium: sender -> receiver" or "medium: one <-> other"'),
    ("radio: leader rover_1", "expected"),
    ("radio: leader -> rover_1 rover_2", "expected"),
    ("radoi: leader -> rover_1", "'radoi' names no medium of the scenario: nearest: 'radio'"),
    ("radio: laeder -> rover_1", "'laeder' names no node on medium 'radio': nearest: 'leader'"),
    ("radio: leader -> arm", "'arm' names no node on medium 'radio': expected one of leader, rover_1, rover_2"),
    ("radio: zz* -> leader", "'zz*' names no node on medium 'radio'"),
    ("radio: leader -> leader", "a link leads to another node: name a receiver other than 'leader' on medium 'radio'"),
])
def test_what_means_no_link_is_refused_with_text_rule_and_nearest_name(text, message):
    with pytest.raises(LinkSelectorError) as refusal:
        parse(text).resolve(NODES)

    assert message in str(refusal.value)
    assert repr(text) in str(refusal.value)


@settings(deadline=None)
@given(st.text("aer:-<>*[ ", max_size=12))
def test_any_text_means_links_or_is_refused(text):
    nodes = {"a": ["a", "e", "r"]}

    with suppress(LinkSelectorError):
        links = parse(text).resolve(nodes)
        assert links
        assert all(sender != receiver and {sender, receiver} < set(nodes[medium]) for medium, sender, receiver in links)
