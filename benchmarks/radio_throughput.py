"""Draws the figure of docs/models/broadcast_radio.md: throughput of the broadcast radio over its load.

    python -m benchmarks.radio_throughput [--frames 4000] [--out docs/models/broadcast_radio.svg]

Poisson arrivals at 40 nodes on a complete graph, `radio_network`, frames of 60 bytes. A frame counts as carried if a
41st node, which only receives, gets it. Load and throughput are in frames per airtime.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from math import exp
from pathlib import Path
from random import Random
from typing import Any

from netem.core.agenda import OFFER, Agenda
from netem.media.broadcast_radio import BroadcastRadio
from netem.media.links import Links
from netem.media.radio_settings import CarrierSenseSettings, RadioSettings
from netem.records.ledger import Ledger

SENDERS = [f"n{k}" for k in range(40)]
LISTENER = "listener"
SIZE_BYTES = 60
LOADS = [0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0]

Curve = tuple[str, str, dict[str, Any], bool, Callable[[float], float] | None]
CURVES: list[Curve] = [                 # label, colour, settings, slotted, closed form
    ("ALOHA, G exp(-2G)", "#c0392b", {"preset": "xbee_802154", "mac": "aloha"}, False, lambda g: g * exp(-2 * g)),
    ("slotted ALOHA, G exp(-G)", "#d68910", {"preset": "xbee_802154", "mac": "none"}, True, lambda g: g * exp(-g)),
    ("csma, xbee_802154", "#1f618d", {"preset": "xbee_802154", "mac": "csma"}, False, None),
    ("csma, xbee_802154, min_exponent 3", "#2e86c1",
     {"preset": "xbee_802154", "mac": "csma", "csma": CarrierSenseSettings(min_exponent=3)}, False, None),
    ("csma, wifi_broadcast_80211g_6mbps", "#117a65", {"preset": "wifi_broadcast_80211g_6mbps", "mac": "csma"}, False,
     None),
    ("csma, crazyflie_p2p", "#7d3c98", {"preset": "crazyflie_p2p", "mac": "csma"}, False, None),
]


def throughput(settings: dict[str, Any], load: float, frames: int, slotted: bool) -> float:
    """Frames that the 41st node received, per airtime."""
    agenda, ledger, heard = Agenda(), Ledger(), []

    def deliver(receiver: str, medium: str, arrival_ns: int, data: bytes) -> bool:
        if receiver == LISTENER:
            heard.append(arrival_ns)
        return True

    radio = BroadcastRadio("radio", RadioSettings(**settings), [*SENDERS, LISTENER], agenda, ledger,
                           Links(ledger, deliver, {}), Random)
    airtime_ns, rng, t = radio.radio.airtime_ns(SIZE_BYTES), Random(f"{settings}{load}"), 0.0
    for k in range(frames):
        t += rng.expovariate(load / airtime_ns)
        at_ns = int(t) // airtime_ns * airtime_ns if slotted else int(t)
        sender = SENDERS[k % len(SENDERS)]
        agenda.at(at_ns, OFFER, sender, partial(radio.offer, sender, bytes(SIZE_BYTES), at_ns))
    agenda.run_before(int(t))
    return len(heard) * airtime_ns / t


WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 720, 420, 60, 50, 20, 20


def x(load: float) -> float:
    return LEFT + load / 2 * (WIDTH - LEFT - RIGHT)


def y(carried: float) -> float:
    return HEIGHT - BOTTOM - carried * (HEIGHT - BOTTOM - TOP)


def svg(points: Sequence[Sequence[float]]) -> str:
    """The figure: a line for the closed form of each curve, if there is one, and dots for the measurements."""
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
             f'font-size="13"><rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for tick in range(11):
        parts.append(f'<path d="M{LEFT} {y(tick / 10):.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>'
                     f'<text x="{LEFT - 8}" y="{y(tick / 10) + 4:.1f}" text-anchor="end">{tick / 10:.1f}</text>')
    for tick in range(5):
        parts.append(f'<text x="{x(tick / 2):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{tick / 2:.1f}'
                     f'</text>')
    parts.append(f'<text x="{(WIDTH + LEFT) / 2}" y="{HEIGHT - 10}" text-anchor="middle">offered load G, frames per '
                 f'airtime</text><text x="16" y="{HEIGHT / 2}" text-anchor="middle" '
                 f'transform="rotate(-90 16 {HEIGHT / 2})">throughput S, frames per airtime</text>')
    for row, ((label, colour, _, _, closed), carried) in enumerate(zip(CURVES, points, strict=True)):
        grid = [k / 50 for k in range(101)]
        line = [(g, closed(g)) for g in grid] if closed else list(zip(LOADS, carried, strict=True))
        path = " ".join(f"{x(g):.1f},{y(s):.1f}" for g, s in line)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        parts += [f'<circle cx="{x(g):.1f}" cy="{y(s):.1f}" r="3.5" fill="{colour}"/>'
                  for g, s in zip(LOADS, carried, strict=True)]
        parts.append(f'<circle cx="{LEFT + 20}" cy="{TOP + 16 + 18 * row}" r="3.5" fill="{colour}"/>'
                     f'<text x="{LEFT + 30}" y="{TOP + 20 + 18 * row}">{label}</text>')
    return "\n".join([*parts, "</svg>\n"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=4000)
    parser.add_argument("--out", type=Path, default=Path("docs/models/broadcast_radio.svg"))
    arguments = parser.parse_args()
    points = []
    for label, _, settings, slotted, closed in CURVES:
        points.append([throughput(settings, load, arguments.frames, slotted) for load in LOADS])
        print(label)
        for load, carried in zip(LOADS, points[-1], strict=True):
            print(f"  G {load:4.2f}  S {carried:6.4f}" + (f"  closed form {closed(load):6.4f}" if closed else ""))
    arguments.out.write_text(svg(points))


if __name__ == "__main__":
    main()
