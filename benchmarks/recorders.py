"""What each recorder costs: `python -m benchmarks.recorders`.

A run of `output_sync` (radio, five robots in slots) and one of a CAN bus, inline, with and without each recorder: the
processor time of the run, start and judging left out, the time to close the records, and the sizes of the files.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import marconet
from netem.records.frames_file import FILE, frame_table
from netem.records.table import ASKED_BY_MEDIA

BUS = '''
from netem.media.can.frame import CanFrame, pack

class Beacon:
    def __init__(self, board):
        self.port, self.k = board.port("bus", listen_only=True), 0
        self.number = int(board.name[1:])
        board.every(2_000_000, self.say, offset_ns=200_000 * self.number)

    def say(self):
        self.k += 1
        self.port.send(pack(CanFrame(self.number, self.k.to_bytes(8, "little"))))
'''


def bus(folder: Path, logs: Sequence[str], record: Sequence[str]) -> marconet.Scenario:
    (folder / "beacon.py").write_text(BUS)
    return marconet.Scenario(
        "bus", folder=folder, seed=1, length_s=10.0, sample_period_s=0, record=list(record),
        agents={f"n{k}": {"program": "beacon:Beacon"} for k in range(5)},
        media={"bus": {"kind": "can", "bit_rate_bps": 1_000_000, "log": list(logs)}})


def radio(record: Sequence[str]) -> marconet.Scenario:
    return marconet.load("output_sync", set={"record": list(record)})


def measure(scenario: Any, folder: Path, times: int = 3) -> tuple[float, Path]:
    """Return the least processor time [s] of a whole run, and its folder."""
    least = float("inf")
    for number in range(times):
        began_s = time.process_time()
        run = marconet.run(scenario, host="inline", out=folder / f"run{number}", report=False, overwrite=True)
        least = min(least, time.process_time() - began_s)
    return least, run.folder


def main() -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name, plain, cases in (
                ("output_sync", lambda: radio(()), {kinds: (lambda kinds=kinds: radio(kinds))
                                                    for kinds in (("frames",), ("frames", "pcapng"))}),
                ("CAN bus", lambda: bus(folder, (), ()), {
                    **{(log,): (lambda log=log: bus(folder, (log,), ())) for log in ASKED_BY_MEDIA},
                    **{kinds: (lambda kinds=kinds: bus(folder, (), kinds))
                       for kinds in (("frames",), ("frames", "pcapng"))}})):
            without_s, run = measure(plain(), folder)
            _, kept = measure(cases["frames",](), folder, 1)
            frames = frame_table(kept).num_rows
            held = {path.name for path in run.iterdir()}
            print(f"{name}: {frames} frames, {without_s:.2f} s without a recorder")
            for kinds, build in cases.items():
                with_s, run = measure(build(), folder)
                sizes = {path.name: path.stat().st_size for path in run.iterdir() if path.name not in held - {FILE}}
                told = ", ".join(f"{file} {size / frames:.1f} B a frame" for file, size in sorted(sizes.items())
                                 if not file.endswith(".lua"))
                print(f"  {' + '.join(kinds):16} {with_s:.2f} s, {(with_s - without_s) / frames * 1e6:+.1f} us a "
                      f"frame: {told}")


if __name__ == "__main__":
    main()
