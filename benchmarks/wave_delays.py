"""Draws the figure of docs/models/waves.md: the spectral radius of a round over the delay, with waves and without.

    python -m benchmarks.wave_delays [--scenario scenarios/output_sync_waves.toml] [--out FILE.svg]

The agents and the graph are those that the scenario's `[team]` has behind their ports; all links have the same delay.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Callable
from pathlib import Path

from agents.waves.network import Network
from agents.waves.output_loop import OutputLoop
from agents.waves.team import read_wave_team
from agents.waves.wave_loop import wave_loop

LONGEST_SLOTS, STEPS = 12, 240
RADIUS = (0.90, 1.10)
WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 560, 340, 60, 20, 50
LABELS = {"waves": (9.4, "#117a65"), "outputs, own late": (9.4, "#c0392b"), "outputs, own at once": (5.9, "#1f618d")}


def place(slots: float, radius: float) -> tuple[float, float]:
    share = (min(max(radius, RADIUS[0]), RADIUS[1]) - RADIUS[0]) / (RADIUS[1] - RADIUS[0])
    return LEFT + slots / LONGEST_SLOTS * (WIDTH - LEFT - 20), HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)


def text(x: float, y: float, words: str, anchor: str = "middle", colour: str = "#000") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{words}</text>'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", type=Path, default=Path("scenarios/output_sync_waves.toml"))
    parser.add_argument("--out", type=Path, default=Path("docs/models/waves.svg"))
    arguments = parser.parse_args()
    team = read_wave_team(tomllib.loads(arguments.scenario.read_text(encoding="utf-8"))["team"])
    network = Network(tuple(team.agents), dict.fromkeys(team.edges, 0), team.slot_ns)
    radii: dict[str, Callable[[Network], float]] = {
        "waves": lambda delayed: wave_loop(delayed, team.port).radius,
        "outputs, own late": lambda delayed: OutputLoop(delayed, team.damping, True).loop.radius,
        "outputs, own at once": lambda delayed: OutputLoop(delayed, team.damping, False).loop.radius}
    drawn = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
             f'font-size="13"><rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
             text((WIDTH + LEFT) / 2, HEIGHT - 10, "delay of every link, slots (spectral radius of a round)")]
    drawn += [text(place(slots, 0)[0], HEIGHT - BOTTOM + 18, f"{slots}") for slots in range(0, LONGEST_SLOTS + 1, 2)]
    for percent in range(90, 111, 2):
        y = place(0, percent / 100)[1]
        colour = "#888" if percent == 100 else "#eee"
        drawn += [f'<line x1="{LEFT}" y1="{y:.1f}" x2="{WIDTH - 20}" y2="{y:.1f}" stroke="{colour}"/>',
                  text(LEFT - 6, y + 4, f"{percent / 100:g}", "end")]
    for name, (at, colour) in LABELS.items():
        delays = [k * LONGEST_SLOTS / STEPS for k in range(STEPS + 1)]
        points = [place(slots, radii[name](network.with_delay(round(slots * team.slot_ns)))) for slots in delays]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        x, y = min(points, key=lambda point: abs(point[0] - place(at, 0)[0]))
        drawn += [f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.5"/>',
                  text(x - 6, y - 6, name, "end", colour)]
    arguments.out.write_text("\n".join([*drawn, "</svg>\n"]), encoding="utf-8")
    print(f"wrote {arguments.out}")


if __name__ == "__main__":
    main()
