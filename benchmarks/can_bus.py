"""Frames per wall second of the CAN bus: the medium with its ledger, and inline with nodes in windows.

    python -m benchmarks.can_bus [--frames 50000] [--turns 5] [--figure docs/models/can_bus.svg]

Medium: four nodes at 1 Mbit/s, 8 bytes a frame, no contention; a frame is offered, arbitrated, carried, handed to the
links of three receivers and closed in the ledger. `new bytes` has other data in every frame, so nothing comes from the
cache of lengths; `bit errors` one hit bit in 100 000; `queued` frames that all wait at once.
Inline: the same nodes as SimPy processes under the conductor, each with a period of its own; `one window` nodes that
promise their next frame firmly. Times are CPU times of this thread; the median over the turns.

With `--figure` draws worst-case response times of a message set: bound, observed, constructed worst case.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from random import Random
from time import thread_time
from typing import Any

from netem.core.agenda import OFFER, Agenda
from netem.emulator.conductor import Conductor
from netem.media.can.bit_errors import BitErrorSettings
from netem.media.can.bus import CanBus
from netem.media.can.encoded_frame import encode_frame
from netem.media.can.frame import CanFrame, pack
from netem.media.can.messages import CanMessage, periodic
from netem.media.can.response_time import response_time_ns
from netem.media.can.settings import CanSettings
from netem.media.links import Links
from netem.node.node import Node
from netem.records.ledger import COLUMNS, Ledger
from netem.transport.hosts import InlineHost

NODES = ("a", "b", "c", "d")
GOAL = 20_000               # frames per wall second
SLOT_NS = 200_000           # of a frame: at most 132 bits and 3
MS = 1_000_000


def payloads(frames: int, *, new: bool) -> list[bytes]:
    rng = Random("payloads")
    return [pack(CanFrame(0x100 + k % 4, rng.randbytes(8) if new else bytes(8))) for k in range(frames)]


def bus_of(settings: CanSettings, deliver: Callable[..., bool] = lambda *delivery: True) -> tuple[CanBus, Agenda]:
    agenda, ledger = Agenda(), Ledger()
    return CanBus("can", settings, NODES, agenda, ledger, Links(ledger, deliver, {}), Random), agenda


def medium_s(frames: int, *, new: bool, **settings: Any) -> float:
    bus, agenda = bus_of(CanSettings(1_000_000, **settings))
    handed_out = payloads(frames, new=new)
    encode_frame.cache_clear()
    start_s = thread_time()
    for k, data in enumerate(handed_out):
        now_ns, sender = k * SLOT_NS, NODES[k % 4]
        agenda.at(now_ns, OFFER, sender, partial(bus.offer, sender, data, now_ns))
        bus.lookahead_ns(now_ns)
        agenda.run_before(now_ns + SLOT_NS)
    return thread_time() - start_s


def queued_s(frames: int) -> float:
    """Batches of 200 frames that all wait."""
    bus, agenda = bus_of(CanSettings(1_000_000, queue_frames=50))
    handed_out = payloads(frames, new=True)
    start_s = thread_time()
    for first in range(0, frames, 200):
        now_ns = first * SLOT_NS
        for k, data in enumerate(handed_out[first:first + 200]):
            agenda.at(now_ns, OFFER, NODES[k % 4], partial(bus.offer, NODES[k % 4], data, now_ns))
        agenda.run_before(now_ns + 200 * SLOT_NS)
    return thread_time() - start_s


def talker(name: str, period_ns: int, *, firm: bool) -> Node:
    node, place = Node(name, ["can"]), NODES.index(name)
    node.ports["can"].on_receive = lambda data: None

    def talk():  # type: ignore[no-untyped-def]
        send, k = node.ports["can"].send, 0
        while True:
            next_ns = place * 150_000 + k * period_ns
            if firm:
                node.promise_firm(next_ns)
            yield node.env.timeout(next_ns - node.now_ns)
            send(pack(CanFrame(0x100 + place, k.to_bytes(8, "little"))))
            k += 1

    node.start(talk())
    return node


def inline_s(frames: int, *, firm: bool) -> float:
    period_ns = 4 * SLOT_NS
    end_ns = frames // 4 * period_ns
    host = InlineHost({name: partial(talker, name, period_ns, firm=firm) for name in NODES})
    conductor = Conductor(Agenda(), host, end_ns)
    ledger = Ledger()
    bus = CanBus("can", CanSettings(1_000_000), NODES, conductor.agenda, ledger,
                 Links(ledger, conductor.deliver, {}, end_ns), Random)
    conductor.admit(host.start(), {"can": bus})
    start_s = thread_time()
    conductor.run()
    took_s = thread_time() - start_s
    bus.finish(end_ns)
    assert ledger.finish().by_fate["delivered"] >= 3 * (frames - 8)
    return took_s


CASES: dict[str, Callable[[int], float]] = {
    "medium, same bytes": partial(medium_s, new=False),
    "medium, new bytes": partial(medium_s, new=True),
    "medium, new bytes, bit errors": partial(medium_s, new=True, bit_errors=BitErrorSettings(1e-5)),
    "medium, new bytes, queued": queued_s,
    "inline with nodes": partial(inline_s, firm=False),
    "inline with nodes, one window": partial(inline_s, firm=True),
}


# --- the figure

BIT_NS = 2000
DRIVE = {
    "stop": CanMessage(0x010, 20 * MS, "a", 1), "setpoint": CanMessage(0x078, 2 * MS, "b"),
    "imu": CanMessage(0x07B, 4 * MS, "c"), "right": CanMessage(0x0CC, 2_500_000, "c"),
    "left": CanMessage(0x0F4, 2 * MS, "a"), "odometry": CanMessage(0x1F4, 5 * MS, "a"),
    "battery": CanMessage(0x7F0, 10 * MS, "b"), "log": CanMessage(0x12345 << 10, 10 * MS, "c", extended=True),
}
WIDTH, ROW, LEFT, TOP, PANEL = 760, 30, 90, 40, 560


def bits_of(message: CanMessage, data: bytes) -> int:
    return encode_frame(pack(CanFrame(message.id, data, message.extended))).nominal_bits


def stuffed_data(message: CanMessage) -> bytes:
    rotations = (bytes([(0x0F0F >> turn) & 0xFF] * message.length_bytes) for turn in range(8))
    return max(rotations, key=lambda data: bits_of(message, data))


def observed_ns(phases_ns: dict[str, int], data: dict[str, bytes], end_ns: int) -> dict[str, int]:
    """Largest time from handing out to the end of the intermission."""
    agenda, ledger = Agenda(), Ledger()
    bus = CanBus("can", CanSettings(500_000, queue_frames=100), NODES, agenda, ledger,
                 Links(ledger, lambda *delivery: True, {}), Random)
    names: dict[tuple[str, int], str] = {}
    counts = dict.fromkeys(NODES, 0)
    for at_ns, sender, name in sorted((at_ns, message.sender, key) for key, message in DRIVE.items()
                                      for at_ns in range(phases_ns[key], end_ns, message.period_ns)):
        offered = pack(CanFrame(DRIVE[name].id, data[name], DRIVE[name].extended))
        agenda.at(at_ns, OFFER, sender, partial(bus.offer, sender, offered, at_ns))
        names[sender, counts[sender]] = name
        counts[sender] += 1
    agenda.run_before(end_ns + 50 * MS)
    worst = dict.fromkeys(DRIVE, 0)
    for row in (dict(zip(COLUMNS, row, strict=True)) for row in ledger.rows):
        if row["receiver"] == "d":
            name = names[row["sender"], row["number"]]
            worst[name] = max(worst[name], row["end_ns"] + 3 * BIT_NS - row["offered_ns"])
    return worst


def response_times() -> list[tuple[str, int, int, int]]:
    """(message, bound, constructed worst case, largest of 50 random runs), in ns, highest priority first."""
    analysed = periodic(DRIVE, CanSettings(500_000).clock)
    order = [message.name for message in analysed]
    rng = Random("phases")
    runs = [observed_ns({name: rng.randrange(message.period_ns) for name, message in DRIVE.items()},
                        {name: rng.randbytes(message.length_bytes) for name, message in DRIVE.items()}, 200 * MS)
            for _ in range(50)]
    worst_data = {name: stuffed_data(message) for name, message in DRIVE.items()}
    rows = []
    for place, name in enumerate(order):
        phases_ns, lower = dict.fromkeys(order, BIT_NS), order[place + 1:]
        if lower:
            blocker = max(lower, key=lambda other: bits_of(DRIVE[other], worst_data[other]))
            phases_ns |= dict.fromkeys(lower, 10 * MS) | {blocker: 0}
        rows.append((name, response_time_ns(analysed, place, BIT_NS) or 0,
                     observed_ns(phases_ns, worst_data, 9 * MS)[name], max(run[name] for run in runs)))
    return rows


def figure(rows: Sequence[tuple[str, int, int, int]]) -> str:
    longest = max(bound for _, bound, _, _ in rows)
    height = TOP + ROW * len(rows) + 40

    def x(ns: int) -> float:
        return LEFT + PANEL * ns / longest

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" '
             f'font-size="13"><rect width="{WIDTH}" height="{height}" fill="white"/>',
             f'<text x="{LEFT}" y="22">response time, ms: <tspan fill="#c0392b">| bound</tspan>, '
             f'<tspan fill="#1f618d">■ constructed worst case</tspan>, <tspan fill="#117a65">● 50 random runs</tspan>'
             f'</text>']
    for row, (name, bound, constructed, seen) in enumerate(rows):
        y = TOP + ROW * row
        parts += [f'<text x="{LEFT - 8}" y="{y + 16}" text-anchor="end">{name}</text>',
                  f'<rect x="{LEFT}" y="{y + 5}" width="{x(constructed) - LEFT:.1f}" height="14" fill="#aed6f1"/>',
                  f'<rect x="{x(bound) - 1:.1f}" y="{y}" width="2" height="24" fill="#c0392b"/>',
                  f'<circle cx="{x(seen):.1f}" cy="{y + 12}" r="4" fill="#117a65"/>',
                  f'<text x="{x(bound) + 6:.1f}" y="{y + 16}" fill="#c0392b">{bound / MS:.2f}</text>']
    axis = TOP + ROW * len(rows) + 18
    parts += [f'<text x="{x(tenth * MS // 2):.1f}" y="{axis}" text-anchor="middle">{tenth / 2:g}</text>'
              for tenth in range(2 * longest // MS + 1)]
    return "\n".join([*parts, "</svg>\n"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=50_000)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--figure", type=Path, help="draw response times to this file, and measure no speed")
    arguments = parser.parse_args()
    if arguments.figure is not None:
        arguments.figure.write_text(figure(response_times()))
        print(f"wrote {arguments.figure}")
        return
    for name, measure in CASES.items():
        took_s = statistics.median(measure(arguments.frames) for _ in range(arguments.turns))
        rate = arguments.frames / took_s
        print(f"{name:32s} {rate:9.0f} frames/s {took_s / arguments.frames * 1e6:6.1f} us a frame   "
              f"goal {GOAL}: {'met' if rate >= GOAL else 'NOT met'}")


if __name__ == "__main__":
    main()
