"""100 000 datagrams from outside to the quadrotor, MAVLink whole and damaged, and noise: none ends the run.

More: `python -m tests.fuzz.test_datagrams COUNT SEED`.
"""

from __future__ import annotations

import socket
import sys
import tempfile
import threading
import time
from pathlib import Path
from random import Random

import pytest
from pymavlink.dialects.v20 import common

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import load
from tests.free_port import free_port

QUADROTOR = Path(__file__).parents[1] / "cases" / "mav_two_gcs" / "quad_two.toml"
DATAGRAMS = 100_000
PER_S = 5_000               # the system's buffer of 212 kB holds what comes in 100 ms
QUIET_S = 1.0               # after the last datagram


def frames(rng: Random) -> list[bytes]:
    """One frame of each message of the dialect, with random fields."""
    mav, found = common.MAVLink(None, srcSystem=250, srcComponent=190), []
    for kind in common.mavlink_map.values():
        length = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
        values = [bytes(rng.randbytes(length[name])) if type_name == "char" else
                  [rng.randrange(100)] * length[name] if length[name] else rng.randrange(100)
                  for name, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True)]
        found.append(bytes(kind(*values).pack(mav)))
    return found


def damaged(rng: Random, known: list[bytes]) -> bytes:
    """A datagram: a frame, two, a part, one with flipped bits, or noise."""
    frame = bytearray(rng.choice(known))
    match rng.randrange(6):
        case 0:
            return bytes(frame)
        case 1:
            return bytes(frame + rng.choice(known))
        case 2:
            return bytes(frame[:rng.randrange(len(frame))])
        case 3:
            frame[rng.randrange(len(frame))] ^= 1 << rng.randrange(8)
            return bytes(frame)
        case 4:
            return bytes(frame[rng.randrange(len(frame)):] + frame)
    return rng.randbytes(rng.randrange(300))


class Attacker(threading.Thread):
    def __init__(self, port: int, count: int, seed: int) -> None:
        super().__init__(daemon=True)
        self.port, self.count, self.rng = port, count, Random(seed)

    def run(self) -> None:
        known = frames(self.rng)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
            began_s = time.monotonic()
            for k in range(self.count):
                here.sendto(damaged(self.rng, known), ("127.0.0.1", self.port))
                if k % 50 == 0:
                    time.sleep(max(0.0, began_s + k / PER_S - time.monotonic()))


def attacked(folder: Path, count: int, seed: int) -> dict[str, int]:
    """Counters of the gateway after a run in which `count` datagrams came in."""
    port = free_port(socket.SOCK_DGRAM)
    scenario = load(QUADROTOR, duration_s=count / PER_S + QUIET_S, overrides=[
        f"gateways.ground.listen='127.0.0.1:{port}'", "media.telemetry.baud_bps=20_000_000",
        "media.telemetry.buffer_bytes=1_000_000"])
    attacker = Attacker(port, count, seed)
    attacker.start()
    result = run(scenario, host="inline", out=folder, report=False, real_time=True)
    attacker.join()
    data = load_run(result.folder)
    assert len(data.ledger.only(sender="ground")) == data.counters["ground"]["datagrams received"]
    return data.counters["ground"]


@pytest.mark.slow
def test_damaged_datagrams_end_no_run_and_each_that_comes_in_is_in_the_ledger(tmp_path: Path) -> None:
    counted = attacked(tmp_path / "run", DATAGRAMS, seed=1)

    assert counted["datagrams received"] > DATAGRAMS // 2       # the others the system's buffer had no room for
    assert counted["datagrams refused"] == 0


if __name__ == "__main__":
    print(attacked(Path(tempfile.mkdtemp()) / "run", int(sys.argv[1]), int(sys.argv[2])))
