"""Mutates recorded logs and reads each: `python tests/fuzz/logs.py 100000 --seed 1`.

What is accepted is fine. What is refused has to come as the reader's own error of one line that names the file. Prints
every mutant that breaks this or takes longer than a second.
"""

from __future__ import annotations

import argparse
import logging
import random
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import marconet
from experiments.run.export import export_frames
from firmware_sim.mavlink.dialect import layout_of, message, pack
from firmware_sim.mavlink.framing import build
from firmware_sim.mavlink.tlog import STAMP, BadLog, read_tlog
from netem.media.can.can_log_reader import BadCanLog, read_can_log
from netem.media.can.captured import offered
from netem.media.can.frame import MalformedFrame
from netem.records.frames_file import FILE, NoFrames, frame_table, frames_of
from netem.records.pcapng_file import BadCapture, read_packets
from tests.experiments.run.recorded_team import EVERY_LOG, team

SLOW_S = 1.0
Mutation = Callable[[bytes, random.Random], bytes]


class Broken(NamedTuple):
    file: str
    number: int
    why: str


def samples(folder: Path) -> dict[str, bytes]:
    """One small file of each format, by its name."""
    run = marconet.run(team(folder, record="frames", length_s=0.03), host="inline", out=folder / "run").folder
    found = {FILE: (run / FILE).read_bytes()}
    for kind in ("pcapng", *EVERY_LOG):
        path = export_frames(run, kind, None, folder / kind)[0]
        found[path.name] = path.read_bytes()
    frames = [build(layout_of("HEARTBEAT"), pack(message("HEARTBEAT", type=2)), k, 1, 1) for k in range(8)]
    found["flight.tlog"] = b"".join(STAMP.pack(1000 * k) + data for k, data in enumerate(frames))
    return found


def read(path: Path) -> None:
    """Read the file as the player or the export of its format does."""
    if path.suffix == ".pcapng":
        for packet in read_packets(path):
            if packet.link_type == 227:
                with suppress(MalformedFrame):
                    offered(packet.data)
    elif path.suffix == ".tlog":
        list(read_tlog(path))
    elif path.suffix == ".parquet":
        list(frames_of(frame_table(path.parent)))
    else:
        list(read_can_log(path))


def flip(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1:]


def overwrite(data: bytes, rng: random.Random) -> bytes:
    at, size = rng.randrange(len(data)), rng.choice((1, 2, 4, 8))
    word = rng.choice((b"\xff" * size, bytes(size), b"\x7f" + b"\xff" * (size - 1), rng.randbytes(size)))
    return data[:at] + word + data[at + size:]


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[:rng.randrange(len(data))]


def drop(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + data[at + rng.randrange(1, 40):]


def repeat(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + data[max(0, at - rng.randrange(1, 60)):]


def foreign(data: bytes, rng: random.Random) -> bytes:
    return rng.choice((rng.randbytes(rng.randrange(200)), b"", bytes(500), b"\n" * 50, "ü,;#\u20ac".encode() * 9))


def number(data: bytes, rng: random.Random) -> bytes:
    """Replace a run of digits, as logs in text have them."""
    digits = [k for k in range(len(data)) if data[k:k + 1].isdigit()]
    if not digits:
        return overwrite(data, rng)
    at = rng.choice(digits)
    return data[:at] + rng.choice((b"-1", b"nan", b"1e400", b"99999999999999999999", b"0x", b"", b" ")) + data[at + 1:]


MUTATIONS: tuple[Mutation, ...] = (flip, flip, overwrite, overwrite, cut, drop, repeat, number, number, foreign)


def mutants(files: dict[str, bytes], count: int, seed: int) -> Iterator[tuple[str, int, bytes]]:
    rng = random.Random(seed)
    names = sorted(files)
    for index in range(count):
        name = names[index % len(names)]
        data = files[name]
        for _ in range(rng.choice((1, 1, 2, 4))):
            data = rng.choice(MUTATIONS)(data or b"\0", rng)
        yield name, index, data


def broken(count: int, seed: int) -> list[Broken]:
    """Read `count` mutants; return those that were refused in another way than promised."""
    logging.getLogger("can").setLevel(logging.CRITICAL)
    found = []
    with tempfile.TemporaryDirectory() as place:
        files = samples(Path(place))
        for name, index, data in mutants(files, count, seed):
            path = Path(place, name)
            path.write_bytes(data)
            began_s = time.process_time()
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    read(path)
            except (BadCapture, BadLog, BadCanLog, NoFrames) as error:
                if "\n" in str(error) or name not in str(error):
                    found.append(Broken(name, index, f"more than one line, or without the file: {error}"))
            except Exception:
                found.append(Broken(name, index, traceback.format_exc()))
            if time.process_time() - began_s > SLOW_S:
                found.append(Broken(name, index, f"took {time.process_time() - began_s:.1f} s"))
    return found


def main(arguments: Any = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args(arguments)
    found = broken(chosen.count, chosen.seed)
    for each in found[:20]:
        print(f"{each.file}, mutant {each.number}: {each.why}")
    print(f"{chosen.count} mutants, {len(found)} broken")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
