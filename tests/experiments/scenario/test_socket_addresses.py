"""The key `sockets` of an agent: automatic and written addresses, and every mistake with place and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.run.node_specifications import node_specifications
from experiments.scenario import ScenarioError, load
from firmware_sim.sockets.interface import Interface

SCENARIO = '''
# Two programs with sockets.
# Question: under which addresses?
seed = 1
length_s = 1.0

[agents.a]
program = "talk:main"
sockets = {{ {a} }}

[agents.b]
program = "talk:{b_program}"
media = {b_media}
sockets = {{ {b} }}

[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"

[media.lan]
kind = "packet_network"
rate_bps = 1_000_000

[media.can0]
kind = "can"
bit_rate_bps = 500_000

[media.uart]
kind = "serial_line"
baud_bps = 57_600
'''
PROGRAM = '''
def main():
    pass


class Board:
    def __init__(self, board):
        pass
'''


def loaded(folder: Path, a: str, b: str, b_media: str = '["radio", "lan", "can0", "uart"]', b_program: str = "main"):
    (folder / "talk.py").write_text(PROGRAM)
    file = folder / "s.toml"
    file.write_text(SCENARIO.format(a=a, b=b, b_media=b_media, b_program=b_program))
    return load(file)


def test_automatic_addresses_follow_from_the_order_of_media_and_agents(tmp_path):
    scenario = loaded(tmp_path, 'lan = "ip", radio = "ip", uart = "bare"', 'lan = "ip"')

    specifications = node_specifications(scenario)

    lan = Interface("lan", "10.1.0.0/16", {"a": "10.1.0.1", "b": "10.1.0.2"}, addressed=True)
    assert specifications["a"].interfaces == (
        Interface("radio", "10.0.0.0/16", {"a": "10.0.0.1"}), lan, Interface("uart"))
    assert specifications["b"].interfaces == (lan,)


def test_written_addresses_are_taken(tmp_path):
    scenario = loaded(tmp_path, 'lan = "192.168.1.7/24"', 'lan = "192.168.1.9/24"')

    interface, = node_specifications(scenario)["a"].interfaces

    assert interface == Interface("lan", "192.168.1.0/24", {"a": "192.168.1.7", "b": "192.168.1.9"}, addressed=True)


@pytest.mark.parametrize(("a", "b", "complaint"), [
    ('lam = "ip"', "", 'agents.a.sockets.lam="ip": no such medium; did you mean "lan"?'),
    ('lan = "on"', "", 'agents.a.sockets.lan="on": expected "bare", "ip" or an IPv4 address with its network'),
    ('lan = "10.0.0.1"', "", 'expected "bare", "ip" or an IPv4 address with its network, such as "192.168.1.7/24"'),
    ('lan = "10.0.0.300/8"', "", 'expected "bare", "ip" or an IPv4 address'),
    ('lan = "bare"', "", 'a frame of this medium names its receiver: expected "ip" or an address'),
    ('can0 = "bare"', "", 'agents.a.sockets.can0="bare": a CAN bus carries CAN frames: open it with can.Bus'),
    ('radio = "bare", uart = "bare"', "", "agents.a.sockets: radio and uart are both bare"),
    ('radio = "10.0.0.1/31"', "", "expected a network of at least 4 addresses"),
    ('radio = "10.0.0.0/24"', "", "10.0.0.0 is the first or the last address of 10.0.0.0/24"),
    ('radio = "127.0.0.1/8"', "", "127.0.0.1 is a multicast or loopback address"),
    ('radio = "ip"', 'radio = "bare"', "agents.b.sockets.radio=\"bare\": a has 'ip' on this medium"),
    ('radio = "ip"', 'radio = "10.0.0.2/16"', "a has 'ip' on this medium: automatic addresses for all or for none"),
    ('radio = "10.0.0.2/16"', 'radio = "10.0.0.2/16"', "agents.b.sockets.radio=\"10.0.0.2/16\": a has this address"),
    ('radio = "10.0.0.2/16"', 'radio = "10.1.0.2/16"', "a is in 10.0.0.0/16: one network for all"),
    ('radio = "10.0.0.2/16", lan = "10.0.1.2/24"', "", "10.0.0.0/16 of radio overlaps it: give each medium"),
    ("lan = 3", "", "agents.a.sockets.lan=3: expected text in quotes"),
])
def test_a_mistake_is_told_with_its_place_and_the_remedy(tmp_path, a, b, complaint):
    with pytest.raises(ScenarioError) as error:
        loaded(tmp_path, a, b)

    assert any(complaint in problem for problem in error.value.problems), error.value.problems


def test_a_medium_that_the_agent_is_not_on_and_a_class_as_program(tmp_path):
    with pytest.raises(ScenarioError) as error:
        loaded(tmp_path, "", 'lan = "ip"', b_media='["uart"]', b_program="Board")

    said = "\n".join(error.value.problems)
    assert 'agents.b.sockets.lan="ip": the agent has no port on this medium; it is on uart' in said
    assert "agents.b.sockets: this program is a class, which sends through `board.port`" in said
