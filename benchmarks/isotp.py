"""Measures can-isotp between two blocking programs on a CAN bus: one long message, on both hosts.

    python -m benchmarks.isotp [--bytes 100000] [--bit-rate 500000] [--blocksize 8 0] [--repeats 3]

Bus: virtual time of the last frame's arrival. Wall: from the first grant to the last report of the run. Processor: of
all processes of the run, with loading and start. Medians of the repeated runs. With block size 0 the receiver never
slows the sender down, so its controller's queue has room for all frames. Needs `pip install 'marconet[clients]'`.

The host "virtual" is no run: the same two stacks in two threads on python-can's bus of this name, as fast as they can.
It tells how much of the wall time is can-isotp's own, and how fast this machine is at the moment.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import can
import isotp
import polars
from rich.console import Console
from rich.table import Table

from benchmarks.processor_time import processor_s
from experiments import CODE
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario.loader import load_tables
from firmware_sim.blocking.here import this_program

TO_ECU, TO_TESTER = 0x7E0, 0x7E8
LONGEST = 2**32 - 1


def stack_on(bus: can.BusABC, rx: int, tx: int, blocksize: int) -> isotp.CanStack:
    address = isotp.Address(isotp.AddressingMode.Normal_11bits, rxid=rx, txid=tx)
    params = {"stmin": 0, "blocksize": blocksize, "tx_padding": 0, "blocking_send": True, "max_frame_size": LONGEST,
              "rx_flowcontrol_timeout": 1000, "rx_consecutive_frame_timeout": 1000}
    return isotp.CanStack(bus, address=address, params=params)


def tester(size: int, blocksize: int) -> None:
    """Send one message of `size` bytes."""
    with can.Bus(interface="marconet") as bus:
        stack = stack_on(bus, TO_TESTER, TO_ECU, blocksize)
        stack.start()
        stack.send(bytes(k & 0xFF for k in range(size)), send_timeout=600.0)
        stack.stop()


def ecu(size: int, blocksize: int) -> None:
    """Receive it, and count its bytes."""
    with can.Bus(interface="marconet") as bus:
        stack = stack_on(bus, TO_ECU, TO_TESTER, blocksize)
        stack.start()
        received = stack.recv(block=True, timeout=600.0)
        right = received == bytes(k & 0xFF for k in range(size))
        stack.stop()
    this_program().board.count("bytes", len(received or b"") if right else 0)


class Figures(NamedTuple):
    bus_s: float
    wall_s: float
    processor_s: float
    ledger_hash: str


def tables(size: int, bit_rate: int, blocksize: int) -> dict[str, Any]:
    parameters = {"size": size, "blocksize": blocksize}
    agent = {name: {"program": f"benchmarks.isotp:{name}", "parameters": parameters} for name in ("tester", "ecu")}
    bus = {"kind": "can", "bit_rate_bps": bit_rate, "queue_frames": 32 if blocksize else size}
    return {"seed": 1, "length_s": 200 * size / bit_rate, "sample_period_ms": 0, "agents": agent,
            "media": {"can0": bus}, "expect": {"count.ecu.bytes": {"min": size}}}


def measured(size: int, bit_rate: int, blocksize: int, host: HostName) -> Figures:
    before_s = processor_s()
    with tempfile.TemporaryDirectory() as folder:
        scenario = load_tables(tables(size, bit_rate, blocksize), "How fast?", Path(__file__))
        summary = run(scenario, host=host, out=Path(folder), report=False).summary
        arrivals_ns = polars.read_parquet(Path(folder) / "ledger.parquet")["delivered_ns"]
    assert summary.holds, f"{host}, blocksize {blocksize}: the message did not arrive"
    return Figures(arrivals_ns.max() / 1e9, summary.wall_s, processor_s() - before_s, summary.ledger_hash)


def alone(size: int, blocksize: int) -> tuple[float, float]:
    """Return wall and processor seconds of the message on python-can's virtual bus."""
    with can.Bus(interface="virtual", channel="isotp") as ours, can.Bus(interface="virtual", channel="isotp") as theirs:
        sender = stack_on(ours, TO_TESTER, TO_ECU, blocksize)
        receiver = stack_on(theirs, TO_ECU, TO_TESTER, blocksize)
        receiver.start()
        sender.start()
        began_s, before_s = time.monotonic(), time.process_time()
        sender.send(bytes(k & 0xFF for k in range(size)))
        received = receiver.recv(block=True, timeout=600.0)
        took = time.monotonic() - began_s, time.process_time() - before_s
        sender.stop()
        receiver.stop()
    assert len(received or b"") == size, f"virtual, blocksize {blocksize}: the message did not arrive"
    return took


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bytes", type=int, default=100_000)
    parser.add_argument("--bit-rate", type=int, default=500_000, help="bit/s")
    parser.add_argument("--blocksize", type=int, nargs="+", default=[8, 0])
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    about = f"{options.bytes} bytes; {CODE}; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    table = Table("blocksize", "host", "bus s", "wall s", "processor s", "faster than the bus", "hash", title=about)
    hosts: tuple[HostName, ...] = ("inline", "process")
    for blocksize in options.blocksize:
        found = [alone(options.bytes, blocksize) for _ in range(options.repeats)]
        table.add_row(str(blocksize), "virtual", "", *(f"{median(column):.2f}" for column in zip(*found, strict=True)),
                      "", "")
        for host in hosts:
            runs = [measured(options.bytes, options.bit_rate, blocksize, host) for _ in range(options.repeats)]
            wall_s, used_s = median(each.wall_s for each in runs), median(each.processor_s for each in runs)
            table.add_row(str(blocksize), host, f"{runs[0].bus_s:.2f}", f"{wall_s:.2f}", f"{used_s:.2f}",
                          f"{runs[0].bus_s / wall_s:.2f} x", ", ".join({each.ledger_hash[:6] for each in runs}))
    Console().print(table)


if __name__ == "__main__":
    main()
