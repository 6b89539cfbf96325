from functools import partial
from itertools import pairwise
from math import e, exp, sqrt
from random import Random

import numpy as np
import pytest

from netem.core.random_streams import stream
from netem.topology import Site
from netem.topology.path_loss import PathLoss
from netem.topology.shadowing import ShadowField, Shadowing

SEEDS = 4000


def values(one, other, sigma_db=6.0, correlation_m=20.0):
    """What the fields of many seeds add to one link [dB]."""
    return np.array([ShadowField(Shadowing(sigma_db, correlation_m), partial(stream, seed)).loss_db(one, other)
                     for seed in range(SEEDS)])


@pytest.mark.parametrize(("one", "other"), [((0.0, 0.0), (500.0, 40.0)), ((3.0, 7.0), (11.0, -2.0)),
                                            ((5.0, 5.0), (5.0, 5.0))])
def test_every_link_is_normal_with_the_deviation_named_however_long_it_is(one, other):
    found = values(one, other)

    assert abs(found.mean()) < 4 * 6.0 / sqrt(SEEDS)
    assert abs(found.std() / 6.0 - 1) < 4 / sqrt(2 * SEEDS)
    assert abs((np.abs(found) < 6.0).mean() - 0.6827) < 4 * sqrt(0.6827 * 0.3173 / SEEDS)


def test_the_same_place_has_the_same_shadow_in_both_directions_and_in_any_order_of_questions():
    first, second = (ShadowField(Shadowing(6.0), partial(stream, 7)) for _ in range(2))
    places = [(1.0, 2.0), (80.0, -3.0), (-41.5, 17.0), (0.3, 0.4, 9.0)]
    pairs = [(one, other) for one in places for other in places]

    there = {pair: first.loss_db(*pair) for pair in pairs}

    assert {pair: second.loss_db(*pair) for pair in reversed(pairs)} == there
    assert all(there[one, other] == pytest.approx(there[other, one], abs=1e-12) for one, other in pairs)


def test_the_field_is_continuous_also_over_the_edges_of_the_lattice():
    field = ShadowField(Shadowing(6.0, 20.0), partial(stream, 3))

    walk = [field.loss_db((x / 100, 0.5), (-200.0, 60.0)) for x in range(-5_000, 5_000)]

    assert max(abs(b - a) for a, b in pairwise(walk)) < 0.05      # 1 cm of a spacing of 22 m
    assert max(walk) - min(walk) > 3


def test_the_correlation_along_an_axis_falls_to_1_over_e_at_the_distance_named_and_to_0_at_2_22_of_it():
    def along(shift_m):
        """Correlation of G at places `shift_m` apart, by the links of both to one far place; averaged over places."""
        rng, products = Random(5), []
        for seed in range(SEEDS):
            field = ShadowField(Shadowing(1.0, 20.0), partial(stream, seed))
            x, y = rng.random() * 1000, rng.random() * 1000
            products.append(field.loss_db((x, y), (x, y)) * field.loss_db((x + shift_m, y), (x + shift_m, y)))
        return sum(products) / SEEDS

    tolerance = 4 * sqrt(2 / SEEDS)             # a product of standard normals has at most a variance of 1 + rho^2
    assert abs(along(20.0) - 1 / e) < tolerance
    assert abs(along(44.5)) < tolerance
    assert along(5.0) > exp(-0.25)              # smoother than Gudmundson's exponential near 0


def test_links_of_one_node_to_far_places_are_correlated_by_a_half():
    one, other = values((0.0, 0.0), (500.0, 0.0), 1.0), values((0.0, 0.0), (0.0, 700.0), 1.0)

    rho = float(np.mean(one * other))

    assert abs(rho - 0.5) < 4 * sqrt(1.25 / SEEDS)


def test_a_further_node_changes_no_other_link():
    at_m = {name: (31.0 * k % 170, 47.0 * k % 130) for k, name in enumerate("abcdefg")}
    law = PathLoss("positions", shadowing=Shadowing(8.0))

    def levels(nodes):
        over = law.over(Site(tuple(nodes), {node: at_m[node] for node in nodes}, 0.0, -85.0, partial(stream, 1)))
        return {(one, other): level for one in nodes for other, level in over.reach_at(one, 0).rx_dbm.items()}

    few, many = levels("abcd"), levels("gfedcba")

    assert few == {link: many[link] for link in few}


@pytest.mark.parametrize(("wrong", "says"), [
    ({"sigma_db": -1.0}, "sigma_db=-1.0: expected 0 or more"),
    ({"sigma_db": 1.0, "correlation_m": 0.0}, "correlation_m=0.0: expected > 0"),
])
def test_nonsense_is_refused(wrong, says):
    with pytest.raises(ValueError, match=says):
        Shadowing(**wrong)
