"""Measures Zenoh alone: `python -m benchmarks.zenoh_exchange [--nodes 5] [--windows 3000]`.

Sessions, keys and processes are those of a run, but a node answers every message with the same bytes: no decoding, no
program, no medium. Prints the time per window for 1, 2 and all nodes granted at once. It is a lower bound for a run
with processes, to be compared with `benchmarks.scenario_speed` of the same minute.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time

from netem.transport.zenoh_session import Session, new_secret
from netem.wire import keys

RUN = "exchange"
MESSAGE = bytes(120)            # about the size of a grant with two frames


def echo(endpoint: str, name: str) -> None:
    with Session(sys.stdin.read(), connect=endpoint) as session:
        grants = session.receiver(keys.grant(RUN, name))
        out = session.sender(keys.report(RUN, name))
        out.await_subscriber(10.0)
        out.send(b"ready")
        while (message := grants.receive()[1]) != b"end":
            out.send(message)


def measure(nodes: int, windows: int) -> dict[int, float]:
    """Median microseconds per window, by how many nodes are granted at once."""
    found = {}
    secret = new_secret()
    with Session(secret) as session:
        reports = session.receiver(keys.report(RUN), *(keys.report(RUN, str(index)) for index in range(nodes)))
        grants = [session.sender(keys.grant(RUN, str(index))) for index in range(nodes)]
        processes = [subprocess.Popen([sys.executable, "-m", "benchmarks.zenoh_exchange", session.endpoint, str(index)],
                                      stdin=subprocess.PIPE) for index in range(nodes)]
        for process in processes:
            assert process.stdin is not None
            with process.stdin as pipe:
                pipe.write(secret.encode())
        for _ in processes:
            reports.receive()
        for sender in grants:
            sender.await_subscriber(10.0)
        turn = 0
        for at_once in sorted({1, min(2, nodes), nodes}):
            laps = []
            for _ in range(windows):
                began_s = time.perf_counter()
                for _ in range(at_once):
                    grants[turn % nodes].send(MESSAGE)
                    turn += 1
                for _ in range(at_once):
                    reports.receive()
                laps.append(time.perf_counter() - began_s)
            found[at_once] = statistics.median(laps) * 1e6
        for sender in grants:
            sender.send(b"end")
        for process in processes:
            process.wait()
    return found


def main() -> None:
    if len(sys.argv) == 3 and "/" in sys.argv[1]:
        echo(sys.argv[1], sys.argv[2])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=5)
    parser.add_argument("--windows", type=int, default=3000)
    options = parser.parse_args()
    print(f"{options.nodes} nodes, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, medians")
    for at_once, microseconds in measure(options.nodes, options.windows).items():
        print(f"{at_once:3d} granted at once: {microseconds:6.0f} us per window")


if __name__ == "__main__":
    main()
