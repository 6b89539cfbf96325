"""Draws the figure of docs/models/output_synchronization.md: the largest slot length, by each bound and exactly.

    python -m benchmarks.slot_length_limits [--scenario scenarios/output_sync_reference.toml] [--out FILE.svg]

A panel for each topology that the scenario's `[team]` requests shows the spectral radius of the exact round map over
the slot length, without and with a transmission delay, and the slot length that each small-gain condition certifies.
"""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path

from agents.synchronization.closed_loop import ClosedLoop
from agents.synchronization.exact_loop import ExactLoop, stability_limit
from agents.synchronization.graph import Floats
from agents.synchronization.partition import partition
from agents.synchronization.slot_length import Bound, small_gain_tau_s
from agents.synchronization.team import Team, read_team

DELAY_S = 0.5e-3
LONGEST_S = 14e-3
RADIUS = (0.98, 1.02)
WIDTH, HEIGHT, TOP, BOTTOM, PANEL = 860, 380, 20, 50, 350
LEFT = (55, 495)
COLOURS = {Bound.PRINTED: "#c0392b", Bound.LOGARITHMIC_NORM: "#b9770e", Bound.WIRTINGER: "#117a65"}


def place(left: int, tau_s: float, radius: float) -> tuple[float, float]:
    share = (min(max(radius, RADIUS[0]), RADIUS[1]) - RADIUS[0]) / (RADIUS[1] - RADIUS[0])
    return left + tau_s / LONGEST_S * PANEL, HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)


def text(x: float, y: float, words: str, anchor: str = "middle", colour: str = "#000") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{words}</text>'


def curve(left: int, loop: ExactLoop, delay_s: float, dash: str) -> str:
    taus_s = [k * LONGEST_S / 280 for k in range(1, 281) if k * LONGEST_S / 280 > delay_s]
    points = " ".join("{:.1f},{:.1f}".format(*place(left, t, loop.spectral_radius(t, delay_s))) for t in taus_s)
    return f'<polyline points="{points}" fill="none" stroke="#1f618d" stroke-width="1.5" stroke-dasharray="{dash}"/>'


def mark(left: int, tau_s: float, row: int, label: str, colour: str) -> list[str]:
    x, y = place(left, tau_s, RADIUS[1])[0], TOP + 16 + 18 * row
    return [f'<line x1="{x:.1f}" y1="{y - 10}" x2="{x:.1f}" y2="{HEIGHT - BOTTOM}" stroke="{colour}"/>',
            text(x + (4 if row < 3 else -4), y, f"{label} {tau_s * 1e3:.3g} ms", "start" if row < 3 else "end", colour)]


def panel(left: int, team: Team, laplacian: Floats, name: str) -> list[str]:
    closed = ClosedLoop(tuple(team.agents), laplacian)
    parts = partition(laplacian)
    loop = ExactLoop(closed.agents, laplacian, parts)
    drawn = [f'<rect x="{left}" y="{TOP}" width="{PANEL}" height="{HEIGHT - TOP - BOTTOM}" fill="none" stroke="#ccc"/>',
             text(left + PANEL / 2, HEIGHT - 10, f"slot length, ms ({name}: spectral radius of a round)")]
    drawn += [text(place(left, ms / 1e3, 0)[0], HEIGHT - BOTTOM + 18, f"{ms}") for ms in range(0, 15, 2)]
    drawn += [text(left - 6, place(left, 0, percent / 100)[1] + 4, f"{percent / 100:g}", "end")
              for percent in range(98, 103)]
    y = place(left, 0, 1.0)[1]
    drawn += [f'<line x1="{left}" y1="{y:.1f}" x2="{left + PANEL}" y2="{y:.1f}" stroke="#888"/>',
              curve(left, loop, 0.0, ""), curve(left, loop, DELAY_S, "5 4")]
    for row, bound in enumerate(Bound):
        drawn += mark(left, small_gain_tau_s(closed, len(parts), bound), row, bound.value, COLOURS[bound])
    limit = stability_limit(loop, 1e-4, LONGEST_S)
    if limit is not None:
        drawn += mark(left, limit.stable_s, 3, "exact", "#1f618d")
    return drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", type=Path, default=Path("scenarios/output_sync_reference.toml"))
    parser.add_argument("--out", type=Path, default=Path("docs/models/output_synchronization.svg"))
    arguments = parser.parse_args()
    team = read_team(tomllib.loads(arguments.scenario.read_text(encoding="utf-8"))["team"])
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
            f'font-size="13"><rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>')
    drawn = [head]
    for number, (left, request) in enumerate(zip(LEFT, team.requests, strict=False), start=1):
        drawn += panel(left, team, team.laplacian_of(request.links), f"topology {number}")
    arguments.out.write_text("\n".join([*drawn, "</svg>\n"]), encoding="utf-8")
    print(f"wrote {arguments.out}")


if __name__ == "__main__":
    main()
