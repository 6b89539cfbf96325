from math import log10

import pytest

from netem.topology import Site, TopologyError
from netem.topology.path_loss import PathLoss
from netem.topology.zones import Circle, Rectangle

LINE = {"a": (0.0, 0.0), "b": (10.0, 0.0), "c": (100.0, 0.0), "d": (1000.0, 0.0)}


def over(at_m=LINE, sensitivity_dbm=-85.0, **settings):
    return PathLoss("positions", **settings).over(Site(tuple(at_m), at_m, 0.0, sensitivity_dbm))


def test_power_falls_by_ten_times_the_exponent_per_decade_of_distance():
    topology = over(reference_loss_db=40.0, exponent=2.5)

    assert topology.reach_at("a", 0).rx_dbm == pytest.approx({"b": -65.0, "c": -90.0, "d": -115.0})


def test_nodes_closer_than_the_reference_distance_get_its_power():
    topology = over({"a": (0.0, 0.0), "b": (0.0, 0.0), "c": (0.5, 0.5)})

    assert topology.reach_at("a", 0).rx_dbm == {"b": -40.0, "c": -40.0}


def test_free_space_at_2450_mhz_is_near_the_default_reference_loss():
    wavelength_m = 299_792_458 / 2.45e9

    assert 20 * log10(4 * 3.141592653589793 / wavelength_m) == pytest.approx(PathLoss("positions").reference_loss_db,
                                                                             abs=0.3)


def test_sensitivity_and_fringe_sort_nodes_into_in_range_too_weak_and_not_intended():
    topology = over(exponent=2.5, fringe_db=10.0)           # -65, -90 and -115 dBm against -85

    reach = topology.reach_at("a", 0)
    assert reach.in_range == {"b"}
    assert reach.too_weak == {"c"}
    assert reach.receivers == ("b", "c")
    assert "d" in reach.rx_dbm


def test_a_node_exactly_at_the_sensitivity_is_in_range_and_one_exactly_at_the_fringe_is_too_weak():
    assert over(sensitivity_dbm=-60.0, exponent=2.0).reach_at("a", 0).in_range == {"b"}
    assert over(sensitivity_dbm=-50.0, exponent=2.0, fringe_db=10.0).reach_at("a", 0).too_weak == {"b"}


@pytest.mark.parametrize(("zone", "lossy"), [
    (Circle("circle", (10.0, 0.0), 1.0, 20.0), {"b"}),
    (Rectangle("rectangle", (10.0, -1.0), (100.0, 0.0), 20.0), {"b", "c"}),
    (Rectangle("rectangle", (-1.0, -1.0), (1.0, 1.0), 20.0), {"b", "c", "d"}),
    (Rectangle("rectangle", (20.0, -1.0), (30.0, 1.0), 20.0), set()),          # between a and c, holds neither
])
def test_a_zone_adds_its_loss_to_links_with_an_end_inside(zone, lossy):
    plain, zoned = over().reach_at("a", 0).rx_dbm, over(zones=(zone,)).reach_at("a", 0).rx_dbm

    assert {node for node in zoned if zoned[node] == pytest.approx(plain[node] - 20)} == lossy
    assert all(zoned[node] == plain[node] for node in zoned if node not in lossy)


def test_path_loss_is_the_same_both_ways():
    topology = over(zones=(Circle("circle", (10.0, 0.0), 1.0, 20.0),))

    assert topology.reach_at("a", 0).rx_dbm["b"] == topology.reach_at("b", 0).rx_dbm["a"]


def test_a_node_without_a_position_and_a_position_without_a_node_are_refused():
    with pytest.raises(TopologyError) as error:
        PathLoss("positions", at_m={"x": (0.0, 0.0)}).over(Site(("a",), {}, 0.0, -85.0))

    assert "'a' stands nowhere" in str(error.value)
    assert "at_m names 'x'" in str(error.value)


def test_positions_of_different_dimension_are_refused():
    with pytest.raises(TopologyError, match="has 3 coordinates: expected 2 or 3, the same for all"):
        over({"a": (0.0, 0.0), "b": (0.0, 0.0, 1.0)})


@pytest.mark.parametrize("settings", [{"reference_distance_m": 0.0}, {"exponent": -1.0}, {"fringe_db": -1.0}])
def test_path_loss_refuses_nonsense(settings):
    with pytest.raises(ValueError, match=next(iter(settings))):
        PathLoss("positions", **settings)


def test_zones_refuse_nonsense():
    with pytest.raises(ValueError, match="radius_m=-1"):
        Circle("circle", (0.0, 0.0), -1.0, 3.0)
    with pytest.raises(ValueError, match="expected at most high_m"):
        Rectangle("rectangle", (1.0, 0.0), (0.0, 1.0), 3.0)
