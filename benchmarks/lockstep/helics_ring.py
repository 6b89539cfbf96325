"""Runs the ring in HELICS 3.6: message federates, one process and one core each, one broker, all on 127.0.0.1.

    python -m benchmarks.lockstep.helics_ring --nodes 5 --windows 2000 --variant tcp

Settings, chosen in favour of HELICS:
- period 1 window, UNINTERRUPTIBLE, WAIT_FOR_CURRENT_TIME_UPDATE off, no logging;
- one `helicsFederateRequestTime` per node and window; HELICS delivers a message of time k with the grant of k + 1;
- the heartbeat stays on (one message in 5 s), as nodes whose broker was killed would otherwise never end;
- the broker runs in HELICS' own threads of the coordinating process, which does nothing else meanwhile.

`VARIANTS` has the core types, kinds of endpoints and coordinators of time. With `tcp` and `tcp_ss` any endpoint may
send to any other, so HELICS synchronizes all nodes with all: the work as defined. With `targeted` endpoints it knows
the ring and waits for neighbours only: this is less work, and nodes may be windows apart (see the lead).

On an overloaded machine HELICS' threads sometimes abort a node at its end; its turns are done by then, so the figure is
valid.

Tried, and not faster: an output delay as lookahead, RESTRICTIVE_TIME_POLICY, single-threaded federates and cores.
EVENT_TRIGGERED does not end with targeted endpoints.
"""

from __future__ import annotations

import argparse
import json
import random
import socket
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import helics

from benchmarks.lockstep.children import children, leave_on_sigterm, wait_for_all
from benchmarks.lockstep.helics_member import HelicsMember
from benchmarks.lockstep.ring import Figure, Task, judge, record

MEMBER = "benchmarks.lockstep.helics_member"
LOCAL = "--local_interface=127.0.0.1"
QUIET = "--loglevel=no_print --consoleloglevel=no_print --fileloglevel=no_print"


@dataclass(frozen=True)
class Variant:
    core_type: str
    targeted: bool
    broker_options: str = ""


VARIANTS = {
    "tcp": Variant("tcp", targeted=False),
    "tcp_ss": Variant("tcp_ss", targeted=False),
    "tcp_global": Variant("tcp", targeted=False, broker_options="--globaltime"),
    "tcp_targeted": Variant("tcp", targeted=True),
    "tcp_ss_targeted": Variant("tcp_ss", targeted=True),
}


def free_ports(nodes: int) -> int:
    """Find a port for the broker such that the ports of its cores (every second one from 10 above) are free too.

    It lies below the range from which Linux takes ports for outgoing connections, which a busy machine uses at random.
    """
    for _ in range(100):
        first = random.randrange(10_000, 30_000)
        if all(map(_is_free, range(first, first + 2 * nodes + 12))):
            return first
    raise OSError("127.0.0.1: no free stretch of ports between 10000 and 30000")


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def run(task: Task, variant: str = "tcp", limit_s: float = 120.0) -> Figure:
    chosen = VARIANTS[variant]
    port = free_ports(task.nodes)
    broker_init = f"--federates={task.nodes} --port={port} {LOCAL} {QUIET} {chosen.broker_options}"
    core_init = f"--federates=1 --broker_address=127.0.0.1 --brokerport={port} {LOCAL} {QUIET}"
    with tempfile.TemporaryDirectory(prefix="lockstep_helics_") as folder:
        members = [HelicsMember(index, task, folder, chosen.core_type, core_init, chosen.targeted)
                   for index in range(task.nodes)]
        broker = helics.helicsCreateBroker(chosen.core_type, f"broker_{port}", broker_init)
        try:
            with children([[MEMBER, json.dumps(asdict(member))] for member in members]) as started:
                wait_for_all(started, limit_s, lambda index: record(Path(folder), index).exists())
        finally:
            helics.helicsBrokerDestroy(broker)
            helics.helicsCloseLibrary()
        return judge("HELICS", task, Path(folder), f"{helics.helicsGetVersion()}, {variant}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=5)
    parser.add_argument("--windows", type=int, default=2000)
    parser.add_argument("--warm-up", type=int, default=50)
    parser.add_argument("--variant", choices=VARIANTS, default="tcp")
    parser.add_argument("--limit-s", type=float, default=120.0, help="give up after this long")
    given = parser.parse_args()
    leave_on_sigterm()
    figure = run(Task(given.nodes, given.windows, given.warm_up), given.variant, given.limit_s)
    print(json.dumps(asdict(figure)))


if __name__ == "__main__":
    main()
