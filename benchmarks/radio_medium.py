"""Measures one frame on the broadcast radio without contention: offer, end event, links and ledger.

    python -m benchmarks.radio_medium [--frames 100000]

Five nodes with the preset crazyflie_p2p on a ring, each with two receivers, send in turn, one frame a millisecond.
"""

from __future__ import annotations

import argparse
import time
from functools import partial
from random import Random

from netem.core.agenda import OFFER, Agenda
from netem.media.broadcast_radio import BroadcastRadio
from netem.media.links import Links
from netem.media.radio_settings import RadioSettings
from netem.records.ledger import Ledger
from netem.topology.fixed_graph import FixedGraph

NODES = [f"agent{i}" for i in range(5)]
RING = tuple(f"agent{i} -> agent{(i + k) % 5}" for i in range(5) for k in (1, 2))
SLOT_NS = 1_000_000


def us_per_frame(frames: int, mac: str) -> float:
    agenda, ledger = Agenda(), Ledger()
    settings = RadioSettings(preset="crazyflie_p2p", mac=mac, topology=FixedGraph(links=RING))  # type: ignore[arg-type]
    links = Links(ledger, lambda receiver, medium, arrival_ns, data: True, {})
    radio = BroadcastRadio("radio", settings, NODES, agenda, ledger, links, Random)
    data = bytes(20)
    start_s = time.perf_counter()
    for slot in range(frames):
        now_ns, sender = slot * SLOT_NS, NODES[slot % 5]
        agenda.at(now_ns, OFFER, sender, partial(radio.offer, sender, data, now_ns))
        radio.lookahead_ns(now_ns)
        agenda.run_before(now_ns + SLOT_NS)
    return (time.perf_counter() - start_s) / frames * 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=100_000)
    frames = parser.parse_args().frames
    for mac in ("none", "aloha", "csma"):
        print(f"{mac:6s} {min(us_per_frame(frames, mac) for _ in range(3)):6.2f} us per frame with 2 receivers "
              f"(best of 3)")


if __name__ == "__main__":
    main()
