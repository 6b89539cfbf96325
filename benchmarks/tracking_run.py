"""Draws the figure of docs/models/tracking.md: the 12 s run of section 4.6 without a network, by policy and bound.

    python -m benchmarks.tracking_run [--seed 1] [--out docs/models/tracking.svg] [--emulated]

As Figures 4.5 and 4.6 it shows states, norm of (x, e) and intersampling intervals, with individual gains (left) and the
unified gain (right); red lines mark changes of the reference's inputs. Prints the number of transmissions for each
policy and bound; with `--emulated` also those on radio and bus, in the scenario tracking_individual.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from math import hypot
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from agents.tracking.closed_loop import MS, Run, run
from agents.tracking.error_bound import Bound
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.noise import Noise
from agents.tracking.section_4_6 import GAINS, LENGTH_NS, REFERENCE, START
from agents.triggering.policies.table import POLICIES, PolicySettings, build_policy
from experiments.judge.run_data import load_run
from experiments.run.runner import run as run_scenario
from experiments.scenario import load
from experiments.scenario.library import find
from netem.core.random_streams import stream

WITHOUT_CAMERA = [name for name in POLICIES if name != "event_triggered"]
WIDTH, PANEL, LEFT = 860, 350, (55, 495)
Row = tuple[str, int, int, float, float, tuple[int, ...]]
ROWS: tuple[Row, ...] = (
    ("x1, x2, x3: m, m, rad", 20, 180, -1.5, 4.0, (-1, 0, 1, 2, 3)),
    ("norm of (x, e)", 225, 100, 0.0, 5.0, (0, 2, 4)),
    ("intervals, ms", 350, 150, 0.0, 50.0, (0, 10, 20, 30, 40)))            # label, top, height, from, to, ticks
HEIGHT = 550
COLOURS = ("#1f618d", "#117a65", "#b9770e")
SECOND = 1000 * MS

Point = tuple[int, float]


def made(name: str, bound: Bound, seed: int, max_successive_losses: int = 0) -> Run:
    noise = Noise(stream(seed, "tracking/measuring"), stream(seed, "tracking/driving"))
    settings = PolicySettings(max_successive_losses=max_successive_losses)
    policy = build_policy(name, TrackingErrorSystem(bound=bound), GAINS, settings)
    return run(policy, REFERENCE, START, LENGTH_NS, noise=noise, sample_ns=20 * MS)


class Panel:
    def __init__(self, left: int, row: int) -> None:
        self.left = left
        self.label, self.top, self.height, self.low, self.high, self.ticks = ROWS[row]

    def place(self, t_ns: float, value: float) -> tuple[float, float]:
        share = (min(max(value, self.low), self.high) - self.low) / (self.high - self.low)
        return self.left + t_ns / LENGTH_NS * PANEL, self.top + (1 - share) * self.height

    def frame(self) -> list[str]:
        drawn = [f'<rect x="{self.left}" y="{self.top}" width="{PANEL}" height="{self.height}" fill="none" '
                 f'stroke="#ccc"/>', text(self.left + PANEL - 6, self.top + 16, self.label, "end")]
        drawn += [text(self.left - 6, self.place(0, tick)[1] + 4, f"{tick}", "end") for tick in self.ticks]
        for t_ns in REFERENCE.changes_ns:
            x = self.place(t_ns, 0)[0]
            drawn.append(f'<line x1="{x:.1f}" y1="{self.top}" x2="{x:.1f}" y2="{self.top + self.height}" '
                         f'stroke="#c0392b" stroke-dasharray="3 3"/>')
        return drawn

    def curve(self, points: Iterable[Point], colour: str) -> str:
        places = " ".join("{:.1f},{:.1f}".format(*self.place(*point)) for point in points)
        return f'<polyline points="{places}" fill="none" stroke="{colour}"/>'


def text(x: float, y: float, words: str, anchor: str = "middle") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{words}</text>'


def column(left: int, one: Run, name: str) -> list[str]:
    states, norm, intervals = (Panel(left, row) for row in range(3))
    drawn = [line for panel in (states, norm, intervals) for line in panel.frame()]
    drawn += [states.curve(((s.t_ns, s.x[k]) for s in one.samples), COLOURS[k]) for k in range(3)]
    drawn.append(norm.curve(((s.t_ns, hypot(*s.x, *s.e)) for s in one.samples), COLOURS[0]))
    drawn.append(intervals.curve(((s.t_ns, s.decision.interval_ns / MS) for s in one.transmissions), COLOURS[0]))
    drawn += [text(states.place(s * SECOND, 0)[0], HEIGHT - 30, f"{s}") for s in range(0, 13, 2)]
    drawn.append(text(left + PANEL / 2, HEIGHT - 10, f"s ({name}, {len(one.transmissions)} transmissions)"))
    return drawn


def emulated() -> None:
    """Run the scenario with each policy that transmits, without its `[expect]`, which is for one of them."""
    print(f"\n{'policy on radio and bus':<25} looks   pure loop     more   rms of x over 10-12 s   violated")
    for name, losses in (*((name, 0) for name in WITHOUT_CAMERA), ("individual_gains", 1), ("individual_gains", 2)):
        scenario = load(find("tracking_individual"), overrides=[
            f'agents.companion.parameters.policy="{name}"',
            f"agents.companion.parameters.max_successive_losses={losses}",
            "expect={}", "guarantees={}", "media.can.messages={}"])
        with TemporaryDirectory() as folder:
            data = load_run(run_scenario(scenario, host="inline", out=Path(folder), report=False).folder)
        looks, pure = data.counters["companion"]["measurements"], len(made(name, Bound.LEAST, 1, losses).transmissions)
        error = data.signals["error"]
        rms = float(np.sqrt(np.mean(error.column("norm")[error.time_ns >= 10 * SECOND] ** 2)))
        words = f"{name}, N^D = {losses}" if losses else name
        print(f"{words:<25} {looks:>5}   {pure:>9}   {looks / pure - 1:>6.1%}   {rms:>21.3f}   "
              f"{data.counters['companion'].get('violated assumptions', 0):>8}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("docs/models/tracking.svg"))
    parser.add_argument("--emulated", action="store_true")
    arguments = parser.parse_args()
    print(f"{'policy':<25} {'bound':<17} transmissions   intervals, ms    rms of x over 10-12 s")
    for name, losses in (*((name, 0) for name in POLICIES), ("individual_gains", 1), ("individual_gains", 2)):
        for bound in Bound:
            one = made(name, bound, arguments.seed, losses)
            intervals_ms = [ns / MS for ns in one.intervals_ns]
            words = f"{name}, N^D = {losses}" if losses else name
            print(f"{words:<25} {bound.value:<17} {len(one.transmissions):>13}   {min(intervals_ms):5.2f} to "
                  f"{max(intervals_ms):5.2f}   {one.rms(10 * SECOND, 12 * SECOND):.3f}")
    drawn = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
             f'font-size="13"><rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for left, name, words in zip(LEFT, ("individual_gains", "unified_gain"), ("individual gains", "unified gain"),
                                 strict=True):
        drawn += column(left, made(name, Bound.LEAST, arguments.seed), words)
    arguments.out.write_text("\n".join([*drawn, "</svg>\n"]), encoding="utf-8")
    print(f"wrote {arguments.out}")
    if arguments.emulated:
        emulated()


if __name__ == "__main__":
    main()
