"""The grammar of links, which selectors of impairments, topologies and teams share."""

from __future__ import annotations

import pytest

from netem.core.link_pattern import LinkPattern, matching, parse

NODES = ["r1", "r2", "base"]


def test_both_arrows_are_read_with_or_without_spaces():
    assert parse(" r1 -> r* ") == parse("r1->r*") == LinkPattern("r1", "r*", both_ways=False)
    assert parse("r1 <-> base") == parse("r1<->base") == LinkPattern("r1", "base", both_ways=True)


@pytest.mark.parametrize("text", ["", "r1", "->", "r1 ->", "-> r1", "r1 r2", "r1 -> r2 -> base", "r 1 -> r2"])
def test_what_is_no_link_is_none(text):
    assert parse(text) is None


def test_a_name_that_exists_is_no_pattern():
    assert matching("r[12]", ["r1", "r[12]"]) == ["r[12]"]
    assert matching("r[12]", NODES) == ["r1", "r2"]


def test_links_lead_from_one_node_to_another_unless_a_medium_shows_a_node_to_itself():
    assert LinkPattern("r*", "*", both_ways=False).links(["r1", "r2"], NODES, ["r1"]) == [
        ("r1", "r1"), ("r1", "r2"), ("r1", "base"), ("r2", "r1"), ("r2", "base")]
    assert LinkPattern("r1", "base", both_ways=True).links(["r1"], ["base"]) == [("r1", "base"), ("base", "r1")]
