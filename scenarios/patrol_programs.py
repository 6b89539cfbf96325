"""Plain Zenoh programs of a patrol: rovers are alive and tell their pose, a base watches and asks for their status.

`watch_and_count` lets the run count what the base sees; the other two know nothing of marconet.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import zenoh

POSES_EVERY_S = 0.5
STATUS_EVERY_S = 4.0


def rover(name: str, first_s: float) -> None:
    """Tell the pose twice a second, be alive, and answer for the battery, all after `first_s`."""
    time.sleep(first_s)
    with zenoh.open(zenoh.Config()) as session:
        began = time.monotonic()

        def answer(query: zenoh.Query) -> None:
            charge = 1.0 - 0.001 * (time.monotonic() - began)
            query.reply(f"patrol/status/{name}", json.dumps({"charge": round(charge, 3)}), encoding="application/json")

        session.declare_queryable(f"patrol/status/{name}", answer)
        pose = session.declare_publisher(f"patrol/pose/{name}", encoding="application/json",
                                         priority=zenoh.Priority.REAL_TIME, express=True)
        with session.liveliness().declare_token(f"patrol/alive/{name}"):
            while True:
                time.sleep(POSES_EVERY_S)
                pose.put(json.dumps({"t": round(time.monotonic() - began, 1)}), attachment=name)


def watch(first_s: float, report: Callable[..., Any] = print) -> None:
    """Report each rover that is gone, comes back, tells a pose or answers, all after `first_s`."""
    time.sleep(first_s)
    known: set[str] = set()

    def on_life(sample: zenoh.Sample) -> None:
        name = str(sample.key_expr).rpartition("/")[2]
        if sample.kind == zenoh.SampleKind.DELETE:
            report(f"{name}_gone")
            report(f"{name}_gone_at_s", int(time.monotonic()))
        elif name in known:
            report(f"{name}_back")
            report(f"{name}_back_at_s", int(time.monotonic()))
        known.add(name)

    with zenoh.open(zenoh.Config()) as session:
        session.liveliness().declare_subscriber("patrol/alive/*", on_life, history=True)
        session.declare_subscriber("patrol/pose/*", lambda sample: report(f"poses_of_{sample.attachment.to_string()}"))
        while True:
            time.sleep(STATUS_EVERY_S)
            for reply in session.get("patrol/status/*", target=zenoh.QueryTarget.ALL, timeout=1.0):
                report("answers" if reply.ok else "time_outs")


def watch_and_count(first_s: float) -> None:
    """Watch; each report is a counter of the run."""
    from firmware_sim.blocking.here import this_program

    watch(first_s, this_program().board.count)
