"""Links of a topology as text."""

from __future__ import annotations

from itertools import permutations
from random import Random

from netem.topology.link_names import all_edges, in_words

NODES = ("a", "b", "c", "d")


def test_both_directions_of_a_link_are_one_name():
    assert in_words([("a", "b"), ("c", "a"), ("b", "a"), ("b", "c")]) == "a <-> b, c -> a, b -> c"
    assert in_words([]) == ""


def test_the_text_of_links_is_read_as_the_same_links():
    rng = Random(1)
    every = list(permutations(NODES, 2))
    for _ in range(200):
        links = rng.sample(every, rng.randint(1, len(every)))
        assert all_edges(in_words(links).split(", "), NODES) == (set(links), [])
