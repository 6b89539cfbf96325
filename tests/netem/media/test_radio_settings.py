"""Settings as pydantic's TypeAdapter reads them from a scenario."""

import pytest
from pydantic import TypeAdapter, ValidationError

from netem.media.radio_settings import CarrierSenseSettings, RadioSettings
from netem.media.table import MEDIA
from netem.topology.path_loss import Circle, PathLoss
from netem.topology.switching_graph import GraphChange, SwitchingGraph

ADAPTER = TypeAdapter(RadioSettings)


def test_every_key_arrives_in_its_place():
    settings = ADAPTER.validate_python({
        "preset": "xbee_802154", "decode": "capture", "mac": "csma", "capture_db": 4, "csma": {"min_exponent": 3},
        "topology": {"kind": "switching", "graphs": {"L1": ["a -> b"], "L2": ["b -> a"]}, "repeat_ns": 20,
                     "schedule": [{"at_ns": 0, "graph": "L1"}, {"at_ns": 10, "graph": "L2"}]}})

    assert settings == RadioSettings(
        preset="xbee_802154", decode="capture", mac="csma", capture_db=4.0, csma=CarrierSenseSettings(min_exponent=3),
        topology=SwitchingGraph("switching", {"L1": ("a -> b",), "L2": ("b -> a",)},
                                (GraphChange(0, "L1"), GraphChange(10, "L2")), repeat_ns=20))


def test_positions_take_zones():
    settings = ADAPTER.validate_python({"topology": {"kind": "positions", "zones": [
        {"kind": "circle", "centre_m": [0, 0], "radius_m": 2, "extra_loss_db": 20}]}})

    assert settings.topology == PathLoss("positions", zones=(Circle("circle", (0.0, 0.0), 2.0, 20.0),))


@pytest.mark.parametrize(("wrong", "place"), [
    ({"capture": 3}, ("capture",)),
    ({"csma": {"slots_ns": 3}}, ("csma", "slots_ns")),
    ({"topology": {"kind": "fixed", "link": []}}, ("topology", "fixed", "link")),
    ({"topology": {"kind": "random"}}, ("topology",)),
    ({"topology": {"kind": "switching", "graphs": {}, "schedule": [{"at_ns": 0, "grph": ""}]}},
     ("topology", "switching", "schedule", 0, "graph")),
    ({"decode": "sinr"}, ("decode",)),
    ({"mac": "tdma"}, ("mac",)),
    ({"bit_rate_bps": 0}, ()),
])
def test_unknown_keys_and_values_are_errors_that_name_their_place(wrong, place):
    with pytest.raises(ValidationError) as error:
        ADAPTER.validate_python(wrong)

    assert place in [problem["loc"] for problem in error.value.errors()]


def test_the_table_names_the_medium_and_its_settings():
    assert MEDIA["broadcast_radio"].Settings is RadioSettings
