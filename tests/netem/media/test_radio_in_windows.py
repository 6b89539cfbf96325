"""The radio under the real conductor: talkative nodes that also answer what they hear, in conservative windows."""

import random
from functools import partial

import pytest

from netem.core.agenda import OFFER, Agenda
from netem.emulator.conductor import Conductor
from netem.media.broadcast_radio import BroadcastRadio
from netem.media.links import Links
from netem.media.radio_settings import RadioSettings
from netem.node.node import Node
from netem.records.ledger import Ledger
from netem.topology.switching_graph import GraphChange, SwitchingGraph
from netem.transport.hosts import InlineHost

NODES = ["a", "b", "c", "d"]
END_NS = 300_000_000
SWITCHING = SwitchingGraph("switching", {"ring": ("a -> b", "b -> c", "c -> d", "d -> a"), "all": ("* -> *",)},
                           (GraphChange(0, "ring"), GraphChange(3_000_000, "all")), repeat_ns=7_000_000)


def talkative(name):
    """Speaks at random instants; answers every third frame it hears 20 us later, unless it is speaking just then."""
    node, rng, heard = Node(name, ["radio"]), random.Random(name), []

    def speak():
        while True:
            yield node.env.timeout(rng.randrange(1_000_000, 20_000_000))
            node.ports["radio"].send(bytes(rng.randrange(0, 62)))

    def answer():
        yield node.env.timeout(20_000)
        node.ports["radio"].send(b"heard")

    def hear(data):
        heard.append(data)
        if len(heard) % 3 == 0:
            node.start(answer())

    node.ports["radio"].on_receive = hear
    node.start(speak())
    return node


class RecordingRadio(BroadcastRadio):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.offers = []

    def offer(self, sender, data, now_ns):
        self.offers.append((now_ns, sender, data))
        super().offer(sender, data, now_ns)


def radio_and_ledger(agenda, deliver, settings):
    ledger = Ledger()
    radio = RecordingRadio("radio", settings, NODES, agenda, ledger, Links(ledger, deliver, {}), random.Random)
    return radio, ledger


@pytest.mark.parametrize("mac", ["none", "aloha", "csma"])
@pytest.mark.parametrize("preset", ["crazyflie_p2p", "xbee_802154", "wifi_broadcast_80211g_6mbps"])
def test_windows_decide_the_same_as_one_pass_over_all_offers(preset, mac):
    settings = RadioSettings(preset=preset, mac=mac, topology=SWITCHING)
    conductor = Conductor(Agenda(), InlineHost({name: partial(talkative, name) for name in NODES}), END_NS)
    radio, ledger = radio_and_ledger(conductor.agenda, conductor.deliver, settings)
    offers = radio.offers
    conductor.admit(conductor.host.start(), {"radio": radio})
    conductor.run()
    radio.finish(END_NS)
    in_windows = ledger.finish(end_ns=END_NS)

    agenda = Agenda()
    again, ledger = radio_and_ledger(agenda, lambda *delivery: True, settings)
    for at_ns, sender, data in offers:
        agenda.at(at_ns, OFFER, sender, partial(again.offer, sender, data, at_ns))
    agenda.run_before(END_NS)
    again.finish(END_NS)
    in_one_pass = ledger.finish(end_ns=END_NS)
    assert in_windows == in_one_pass
    assert in_windows.by_fate["delivered"] > 20
    assert conductor.instant_rounds == 0
