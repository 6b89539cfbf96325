"""Measures the records: closing copies, writing 50 000 ledger rows and 6 500 samples of 4 signals, and reading both.

    python -m benchmarks.records [--rows 50000] [--repeats 5]

Prints the wall-clock time of the fastest repeat; nothing is asserted.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from math import cos, sin
from pathlib import Path
from time import perf_counter

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.ledger import Ledger
from netem.records.ledger_file import hash_of, read_ledger
from netem.records.signals import SignalFile, read_recording


def fastest(repeats: int, action: Callable[[], object]) -> float:
    """Seconds of the fastest repeat."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        action()
        times.append(perf_counter() - start)
    return min(times)


def close_all(frames: list[Frame], path: Path | None) -> Ledger:
    ledger = Ledger(path)
    close = ledger.close
    for frame in frames:
        close(frame, "r2", Fate.DELIVERED, delivered_ns=frame.offered_ns + 5_000)
    ledger.expect(len(frames))
    return ledger


def record(path: Path, samples: int) -> None:
    recorder = SignalFile(path)
    nodes = [f"r{k}" for k in range(5)]
    for node in nodes:
        recorder.declare(node, [("y", "1"), ("u", "V"), ("x1", "m"), ("x2", "m/s")])
    for k in range(samples // len(nodes)):
        for node in nodes:
            recorder.append(node, k * 10_000_000, (sin(k), cos(k), k / 7, k / 11))
    recorder.finish({})


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--rows", type=int, default=50_000)
    arguments.add_argument("--repeats", type=int, default=5)
    options = arguments.parse_args()
    rows, repeats = options.rows, options.repeats
    frames = [Frame("radio", f"r{k % 5}", k // 5, k * 1_000_000, bytes(40)) for k in range(rows)]
    with tempfile.TemporaryDirectory() as folder:
        parquet, mcap = Path(folder) / "ledger.parquet", Path(folder) / "signals.mcap"
        in_memory = fastest(repeats, lambda: close_all(frames, None))
        with_hash = fastest(repeats, lambda: close_all(frames, None).finish())
        written = fastest(repeats, lambda: close_all(frames, parquet).finish())
        print(f"close, rows kept in memory      {in_memory / rows * 1e9:8.0f} ns per copy")
        print(f"hash                            {(with_hash - in_memory) / rows * 1e9:8.0f} ns per copy")
        print(f"close, hash, write Parquet      {written / rows * 1e9:8.0f} ns per copy, "
              f"{written:.3f} s and {parquet.stat().st_size} bytes for {rows}")
        print(f"read ledger                     {fastest(repeats, lambda: read_ledger(parquet)):8.3f} s")
        print(f"hash it again                   {fastest(repeats, lambda: hash_of(parquet)):8.3f} s")
        print(f"record 6 500 samples x 4        {fastest(repeats, lambda: record(mcap, 6_500)):8.3f} s, "
              f"{mcap.stat().st_size} bytes")
        print(f"read them                       {fastest(repeats, lambda: read_recording(mcap)):8.3f} s")


if __name__ == "__main__":
    main()
