"""Settings of a radio as they are read from a table of a scenario."""

from pathlib import Path

import pytest

from experiments.scenario.problems import Problems
from experiments.scenario.shape import shape_of
from experiments.scenario.table_reader import TableReader
from netem.media.radio_settings import CarrierSenseSettings, RadioSettings
from netem.media.table import MEDIA
from netem.topology.path_loss import PathLoss
from netem.topology.switching_graph import GraphChange, SwitchingGraph
from netem.topology.zones import Circle


def read(table):
    """The settings and what is wrong with them."""
    problems = Problems("few.toml")
    filled = TableReader(problems, Path()).read(shape_of(RadioSettings), table, (), (), RadioSettings)
    return filled.made, problems.lines


def test_every_key_arrives_in_its_place():
    settings, _ = read({
        "preset": "xbee_802154", "decode": "capture", "mac": "csma", "capture_db": 4, "csma": {"min_exponent": 3},
        "topology": {"kind": "switching", "graphs": {"L1": ["a -> b"], "L2": ["b -> a"]}, "repeat_ns": 20,
                     "schedule": [{"at_ns": 0, "graph": "L1"}, {"at_ns": 10, "graph": "L2"}]}})

    assert settings == RadioSettings(
        preset="xbee_802154", decode="capture", mac="csma", capture_db=4.0, csma=CarrierSenseSettings(min_exponent=3),
        topology=SwitchingGraph("switching", {"L1": ("a -> b",), "L2": ("b -> a",)},
                                (GraphChange(0, "L1"), GraphChange(10, "L2")), repeat_ns=20))


def test_positions_take_zones():
    settings, _ = read({"topology": {"kind": "positions", "zones": [
        {"kind": "circle", "centre_m": [0, 0], "radius_m": 2, "extra_loss_db": 20}]}})

    assert settings.topology == PathLoss("positions", zones=(Circle("circle", (0.0, 0.0), 2.0, 20.0),))


@pytest.mark.parametrize(("wrong", "line"), [
    ({"capture": 3}, 'capture=3: unknown key; did you mean "capture_db"?'),
    ({"csma": {"slots_ns": 3}}, 'csma.slots_ns=3: unknown key; did you mean "slot_ns"?'),
    ({"topology": {"kind": "fixed", "link": []}}, 'topology.link=[]: unknown key; did you mean "links"?'),
    ({"topology": {"kind": "fixed", "zones": []}}, 'topology.zones=[]: unknown key; kind = "positions" has it'),
    ({"topology": {"kind": "random"}}, 'topology.kind="random": no such kind; there are fixed, switching, positions'),
    ({"topology": {"kind": "switching", "graphs": {}, "schedule": [{"at_ns": 0, "grph": ""}]}},
     'topology.schedule[0].grph="": unknown key; did you mean "graph"?'),
    ({"decode": "sinr"}, "decode=\"sinr\": expected 'radio_network', 'local' or 'capture'"),
    ({"mac": "tdma"}, "mac=\"tdma\": expected 'none', 'aloha' or 'csma'; did you mean \"csma\"?"),
    ({"bit_rate_bps": 0}, "bit_rate_bps=0: expected at least 1 bit/s"),
])
def test_unknown_keys_and_values_are_errors_that_name_their_place(wrong, line):
    assert read(wrong) == (None, [f"few.toml: {line}"])


def test_the_table_names_the_medium_and_its_settings():
    assert MEDIA["broadcast_radio"].Settings is RadioSettings
