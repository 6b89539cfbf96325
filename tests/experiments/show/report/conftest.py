"""A synthetic run folder: five robots in round-robin slots on a switching graph, with loss and a phase of collisions.

The records are written without a run; they have the form and the size of real ones, so that a report can be built.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.events import Event
from netem.records.ledger import Ledger
from netem.records.signals import SignalFile
from netem.wire.level import Level

HEARD_BY = [  # by topology: sender -> receivers
    {"r1": ["r2", "r4"], "r2": ["r1", "r3", "r4"], "r3": ["r2", "r5"], "r4": ["r1", "r2"], "r5": ["r3", "r4"]},
    {"r1": ["r4"], "r2": ["r1"], "r3": ["r2", "r5"], "r4": ["r5"], "r5": ["r3"]},
]
SLOTS = [["r1", "r3"], ["r2", "r5"], ["r4"]]
SLOT_NS = 1_084_823
AIRTIME_NS = 312_000
TOGGLE_NS = 500_000_000
SAMPLE_NS = 10_000_000


def write_synthetic_run(folder: Path, length_s: float = 13.0) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    length_ns = round(length_s * 1e9)
    ledger = Ledger(folder / "ledger.parquet", metadata={"scenario": "synthetic", "seed": "7"})
    recorder = SignalFile(folder / "signals.mcap")
    _talk(ledger, length_ns)
    _move(recorder, length_ns)
    toggles = list(range(TOGGLE_NS, length_ns, TOGGLE_NS))
    for k, instant in enumerate(toggles):
        for node in HEARD_BY[0]:
            recorder.event(Event(instant + 3 * SLOT_NS, node, "adopted topology", f"L{(k + 1) % 2 + 1}"))
    recorder.event(Event(5_000_000_000, "r4", "promise broken", "a frame at 5 s, promised none before 5.001 s",
                         Level.ERROR))
    result = ledger.finish()
    scenario = {
        "name": "synthetic", "seed": 7, "length_ns": length_ns,
        "question": "Do five robots still agree on their outputs when they only hear each other now and then?",
        "agents": {node: {} for node in HEARD_BY[0]}, "media": {"radio": {"kind": "broadcast_radio"}},
        "expect": {"r*.y.last_abs": {"min": None, "max": 0.5}, "radio.delivery_ratio": {"min": 0.95, "max": None},
                   "max_successive_losses": {"min": None, "max": 400}, "age_of_information_max_s": {"max": 1.2}},
    }
    counters = {node: {"slots_missed": 3 * k, "discoveries": 27} for k, node in enumerate(HEARD_BY[0])}
    run = {"reached_ns": length_ns, "switch_instants_ns": {"radio": toggles}, "counters": counters,
           "versions": {"python": "3.11.7", "marconet": "0.1.0", "eclipse-zenoh": "1.10.0"}}
    summary = {"real_time_factor": 9.7, "wall_s": length_s / 9.7, "host": "process", "windows": 11_984,
               "grants": 19_973}
    for name, content in (("scenario", scenario), ("run", run), ("summary", summary)):
        (folder / f"{name}.json").write_text(json.dumps(content))
    recorder.finish({"scenario": "synthetic", "seed": "7"}, json.dumps(scenario).encode())
    assert result.rows == result.expected
    return folder


def _talk(ledger: Ledger, length_ns: int) -> None:
    draw = Random("synthetic")
    sent = dict.fromkeys(HEARD_BY[0], 0)
    for slot in range(length_ns // SLOT_NS):
        start_ns = slot * SLOT_NS
        for sender in SLOTS[slot % len(SLOTS)]:
            frame = Frame("radio", sender, sent[sender], start_ns, bytes(24), on_air_ns=start_ns + 12_000,
                          end_ns=start_ns + 12_000 + AIRTIME_NS)
            sent[sender] += 1
            for receiver in HEARD_BY[start_ns // TOGGLE_NS % 2][sender]:
                ledger.expect(1, "radio")
                if 5_000_000_000 <= start_ns < 5_300_000_000 and sender in ("r2", "r5"):
                    ledger.close(frame, receiver, Fate.COLLIDED, cause="r2" if sender == "r5" else "r5")
                elif draw.random() < 0.05:
                    ledger.close(frame, receiver, Fate.LOST, cause="impairments[0] bernoulli_loss")
                else:
                    ledger.close(frame, receiver, Fate.DELIVERED, delivered_ns=frame.end_ns + 130_000)


def _move(recorder: SignalFile, length_ns: int) -> None:
    for k, node in enumerate(HEARD_BY[0]):
        recorder.declare(node, [("y", "1"), ("u", "V"), ("error", "1")])
        for time_ns in range(0, length_ns, SAMPLE_NS):
            t = time_ns * 1e-9
            y = (k - 1.7) * math.exp(-0.9 * t) * math.cos((1 + 0.4 * k) * t) + 0.6 * math.exp(-0.4 * t)
            recorder.append(node, time_ns, (y, -2 * y, y - 0.6 * math.exp(-0.4 * t)))


@pytest.fixture(scope="session")
def make_run() -> Callable[[Path, float], Path]:
    return write_synthetic_run


@pytest.fixture(scope="session")
def whole_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a synthetic run of 13 s, which tests must not change."""
    return write_synthetic_run(tmp_path_factory.mktemp("runs") / "synthetic")
