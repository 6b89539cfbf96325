from math import log10, pi

import pytest

from netem.topology import Site
from netem.topology.path_loss import PathLoss
from netem.topology.two_ray import TwoRay

C_MPS = 299_792_458.0


def law(**settings):
    return PathLoss("positions", two_ray=TwoRay(**{"antenna_height_m": 1.5, "frequency_hz": 914e6, **settings}))


def test_the_crossover_is_where_free_space_and_the_fourth_power_agree():
    crossover_m = 4 * pi * 1.5 * 1.5 * 914e6 / C_MPS            # 86.2 m: ns-2's example of its two-ray model

    below, above = (law().loss_db((0.0, 0.0), (crossover_m * factor, 0.0)) for factor in (1 - 1e-9, 1 + 1e-9))

    assert crossover_m == pytest.approx(86.2, abs=0.05)
    assert TwoRay(1.5, 914e6).crossover_m((0.0, 0.0), (1.0, 0.0)) == pytest.approx(crossover_m, rel=1e-12)
    assert above == pytest.approx(below, abs=1e-6)
    assert below == pytest.approx(40 * log10(crossover_m) - 20 * log10(1.5 * 1.5), abs=1e-6)


@pytest.mark.parametrize(("from_m", "to_m", "decades"), [(1.0, 10.0, 20.0), (10.0, 80.0, 20.0), (100.0, 1000.0, 40.0)])
def test_loss_grows_by_20_db_a_decade_before_the_crossover_and_by_40_db_beyond(from_m, to_m, decades):
    grown = law().loss_db((0.0, 0.0), (to_m, 0.0)) - law().loss_db((0.0, 0.0), (from_m, 0.0))

    assert grown == pytest.approx(decades * log10(to_m / from_m))


def test_free_space_at_one_metre_is_the_equation_of_friis():
    assert law(frequency_hz=2.45e9).loss_db((0.0, 0.0), (1.0, 0.0)) == pytest.approx(40.23, abs=0.005)


def test_a_flying_node_has_a_higher_antenna_and_a_farther_crossover():
    ground, air = TwoRay(0.5).crossover_m((0.0, 0.0, 0.0), (9.0, 0.0, 0.0)), TwoRay(0.5).crossover_m(
        (0.0, 0.0, 0.0), (9.0, 0.0, 9.5))

    assert air == pytest.approx(20 * ground)


def test_nodes_between_the_ranges_of_both_laws_tell_them_apart():
    at_m = {"a": (0.0, 0.0), "b": (150.0, 0.0)}                 # 83.5 dB in free space, 0.3 m high antennas: 107.9 dB
    site = Site(tuple(at_m), at_m, 0.0, -85.0)

    assert PathLoss("positions").over(site).graph_at(0) == [("a", "b"), ("b", "a")]
    assert PathLoss("positions", two_ray=TwoRay(0.3)).over(site).graph_at(0) == []


@pytest.mark.parametrize(("wrong", "says"), [
    (lambda: TwoRay(0.0), "antenna_height_m=0.0: expected > 0"),
    (lambda: TwoRay(1.0, -1.0), "frequency_hz=-1.0: expected > 0"),
    (lambda: PathLoss("positions", two_ray=TwoRay(1.0), exponent=3.0), "two_ray: has no reference_loss_db"),
])
def test_nonsense_is_refused(wrong, says):
    with pytest.raises(ValueError, match=says):
        wrong()
