"""Many robots on one radio, all hearing all: what the emulation takes, and what follows it (metrics and report).

    python -m benchmarks.many_robots [COPIES [ROBOTS ...]]

Each robot owns a slot of a round and speaks in it, so that every frame reaches all others: ROBOTS (ROBOTS - 1) copies a
round, as many rounds as COPIES need. Inline host, one process for each run. Bytes per copy: how far the process's
largest memory grows after the emulation. Closing the ledger counts as what follows.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

SLOT_NS = 400_000
PROGRAM = '''
from dataclasses import dataclass


class Speaker:
    @dataclass
    class Settings:
        first_ns: int
        period_ns: int

    def __init__(self, board, settings):
        self.heard = 0
        port = board.port("radio", self.hear, listen_only=True)
        board.every(settings.period_ns, lambda: port.send(b"8 bytes."), offset_ns=settings.first_ns)

    def hear(self, frame):
        self.heard += 1
'''


def scenario(robots: int, rounds: int) -> str:
    lines = ["seed = 1", f"length_s = {robots * rounds * SLOT_NS * 1e-9:.9f}", "[agents]"]
    lines += [f'r{k:03} = {{ program = "speaker:Speaker", parameters = {{ first_us = {k * SLOT_NS // 1000}, '
              f'period_us = {robots * SLOT_NS // 1000} }} }}' for k in range(robots)]
    lines += ["[media.radio]", 'kind = "broadcast_radio"', 'preset = "crazyflie_p2p"', "[expect]",
              "frames_not_delivered = { max = 1000000 }", "age_of_information_mean_s = { min = 0 }",
              "max_successive_losses = { max = 1000000 }", "inter_transmission_min_s = { min = 0 }"]
    return "\n".join(lines)


def run_in(folder: Path) -> dict[str, float]:
    """Processor time [s] and the largest memory so far [MB] when the emulation ended and when the run did."""
    from experiments.run import runner
    from experiments.scenario import load

    loaded = load(folder / "speakers.toml")
    ended: list[float] = []
    conclude = runner._Run._conclude

    def timed(self: runner._Run) -> runner.RunResult:
        ended.extend((time.process_time(), peak_mb()))
        return conclude(self)

    runner._Run._conclude = timed  # type: ignore[method-assign]
    began_s = time.process_time()
    result = runner.run(loaded, host="inline", out=folder / "run")
    return {"emulation_s": ended[0] - began_s, "emulation_mb": ended[1], "after_s": time.process_time() - ended[0],
            "mb": peak_mb(), "copies": float(sum(result.summary.frames.values()))}


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main(copies: int = 1_000_000, *teams: int) -> None:
    for robots in teams or (128, 256):
        with TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "speaker.py").write_text(PROGRAM, encoding="utf-8")
            rounds = max(2, copies // (robots * (robots - 1)))
            (folder / "speakers.toml").write_text(scenario(robots, rounds), encoding="utf-8")
            done = subprocess.run([sys.executable, __file__, "in", name], check=True, capture_output=True, text=True)
            found = json.loads(done.stdout)
        print(f"{robots} robots, {found['copies']:.0f} copies: emulation {found['emulation_s']:.2f} s of processor "
              f"time, {found['emulation_mb']:.0f} MB; metrics and report {found['after_s']:.2f} s, "
              f"{found['after_s'] / found['emulation_s']:.2f} of the emulation, up to {found['mb']:.0f} MB, "
              f"{(found['mb'] - found['emulation_mb']) * 2**20 / found['copies']:.0f} bytes a copy")


if __name__ == "__main__":
    if sys.argv[1:2] == ["in"]:
        print(json.dumps(run_in(Path(sys.argv[2]))))
    else:
        main(*map(int, sys.argv[1:]))
