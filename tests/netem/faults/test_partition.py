"""Who hears whom under each shape of a partition."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.faults import Site
from netem.faults.partition import Partition

counts = st.integers(2, 9)


def cut(count: int, **keys: object) -> set[tuple[str, str]]:
    nodes = tuple(f"n{place}" for place in range(count))
    return {(sender, receiver) for _, sender, receiver in
            Partition(**keys).resolve("radio", Site(nodes, {"radio": nodes}, {}))}       # type: ignore[arg-type]


def hears(count: int, links: set[tuple[str, str]], node: str) -> set[str]:
    """The nodes that `node` still hears, itself included."""
    return {f"n{place}" for place in range(count) if (f"n{place}", node) not in links}


@given(counts)
def test_halves_are_a_majority_and_the_rest(count: int) -> None:
    links = cut(count, shape="halves")

    sizes = {node: len(hears(count, links, node)) for node in (f"n{place}" for place in range(count))}
    assert sorted(sizes.values()) == sorted([(count + 1) // 2] * ((count + 1) // 2) + [count // 2] * (count // 2))
    assert all((receiver, sender) in links for sender, receiver in links)


@given(st.integers(3, 9))
def test_in_a_ring_each_hears_a_majority_and_no_two_the_same(count: int) -> None:
    if count == 3:
        with pytest.raises(ValueError, match="leave all nodes of 'radio' connected"):
            cut(count, shape="ring")
        return
    links = cut(count, shape="ring")

    heard = [frozenset(hears(count, links, f"n{place}")) for place in range(count)]
    assert all(2 * len(group) > count for group in heard)
    if count > 4:
        assert len(set(heard)) == count


@given(st.integers(3, 9))
def test_a_bridge_connects_two_halves_that_do_not_hear_each_other(count: int) -> None:
    links = cut(count, shape="bridge")

    bridge = f"n{count // 2}"
    assert hears(count, links, bridge) == {f"n{place}" for place in range(count)}
    groups = {frozenset(hears(count, links, f"n{place}")) for place in range(count) if f"n{place}" != bridge}
    assert len(groups) == 2
    one, other = groups
    assert one & other == {bridge}


def test_isolated_nodes_hear_nobody_and_are_not_heard() -> None:
    assert cut(4, shape="isolate", nodes=("n0", "n2")) == {
        pair for pair in ((f"n{a}", f"n{b}") for a in range(4) for b in range(4) if a != b)
        if {"n0", "n2"} & set(pair)}


def test_patterns_name_groups_and_one_way_lets_answers_pass() -> None:
    assert cut(4, groups=(("n[01]",), ("n2", "n3")), one_way=True) == {
        ("n0", "n2"), ("n0", "n3"), ("n1", "n2"), ("n1", "n3")}
