"""Measures and draws docs/models/aerial_pursuit.md: `python -m benchmarks.aerial_pursuit [--seeds 10]`.

Runs `hummingbird_chases_rovio` with several seeds. Prints the number of looks, the least distance to the boundary of
the field of view, and the time from a waypoint until the vehicle flies there; draws the run with the scenario's own
seed, as in Figure 3.11 of Tolic 2012.
"""

from __future__ import annotations

import argparse
import tempfile
from itertools import pairwise
from pathlib import Path
from statistics import median

import numpy as np

from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import find, load

SCENARIO = "hummingbird_chases_rovio"
FIGURE = Path(__file__).parents[1] / "docs" / "models" / "aerial_pursuit.svg"
BLUE, RED, GREEN, ORANGE, GREY = "#2471a3", "#c0392b", "#1e8449", "#b9770e", "#999999"
ROWS = (                                    # name, scale, zero; curves: table, signal, colour
    ("roll and pitch, deg", 20.0, 0.0, (("attitude", "roll", BLUE), ("attitude", "pitch", RED))),
    ("heading, deg", 5.0, 0.0, (("attitude", "heading", ORANGE),)),
    ("height - 1.5 m, m", 0.1, 1.5, (("height", "ramp", GREY), ("height", "quadrotor", GREEN))),
    ("east, m: waypoint, ramp, quadrotor", 3.0, 0.0,
     (("east", "waypoint", ORANGE), ("east", "ramp", GREY), ("east", "quadrotor", BLUE))),
    ("north, m: waypoint, ramp, quadrotor", 3.0, 0.0,
     (("north", "waypoint", ORANGE), ("north", "ramp", GREY), ("north", "quadrotor", BLUE))),
    ("quadrotor to Rovio, m (field of view: 1.2 m)", 1.2, 0.0, (("from_quadrotor", "rovio", RED),)))
FASTER_MPS, FAR_M = 0.3, 0.3                # speed above the Rovio's; least distance of waypoints that are timed
FROM_S = 8.0


def flown(seed: int | None, folder: Path) -> RunData:
    return load_run(run(load(find(SCENARIO), seed=seed), host="inline", out=folder, report=False).folder)


def responses_s(data: RunData) -> list[float]:
    """Time from each new waypoint ahead until the vehicle flies towards it faster than the Rovio can escape."""
    ground, vehicle = data.signals["companion"], data.signals["quadrotor"]
    time_s = ground.time_ns * 1e-9
    goal = np.column_stack([ground.column("waypoint_x"), ground.column("waypoint_y")])
    place = np.column_stack([vehicle.column("x"), vehicle.column("y")])
    speed = np.column_stack([vehicle.column("v[1]"), vehicle.column("v[2]")])
    changes = [*(np.flatnonzero(np.any(np.diff(goal, axis=0) != 0, axis=1)) + 1).tolist(), len(goal)]
    found = []
    for k, following in pairwise(changes):
        way = goal[k] - place[k]
        ahead = float(np.hypot(*way))
        towards = speed[k:following] @ way / max(ahead, 1e-9)
        if time_s[k] < FROM_S or ahead < FAR_M or towards[0] >= FASTER_MPS:
            continue
        fast = np.flatnonzero(towards >= FASTER_MPS)
        if fast.size:
            found.append(float(fast[0] * (time_s[1] - time_s[0])))
    return found


def draw(data: RunData) -> None:
    width, high = 780, 110
    bottom = 20 + high * len(ROWS)
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 900 {bottom + 40}" font-family="sans-serif" '
             f'font-size="13"><rect width="900" height="{bottom + 40}" fill="white"/>']
    for row, (name, scale, zero, curves) in enumerate(ROWS):
        middle = 80 + high * row
        lines.append(f'<path d="M70 {middle}H{70 + width}" stroke="#ddd"/>'
                     f'<text x="75" y="{middle - 45}">{name}</text>'
                     f'<text x="62" y="{middle - 34}" text-anchor="end">{scale:g}</text>'
                     f'<text x="62" y="{middle + 44}" text-anchor="end">-{scale:g}</text>')
        for table, signal, colour in curves:
            values = data.signals[table].column(signal)[::10]
            points = " ".join(f"{70 + width * k / len(values):.1f},"
                              f"{middle - 40 * min(1.0, max(-1.0, (value - zero) / scale)):.1f}"
                              for k, value in enumerate(values.tolist()))
            lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.2"/>')
    for tick_s in range(0, round(data.length_ns * 1e-9) + 1, 10):
        x = 70 + width * tick_s * 1e9 / data.length_ns
        lines.append(f'<path d="M{x:.0f} 20V{bottom}" stroke="#ccc" stroke-dasharray="3 4"/>'
                     f'<text x="{x:.0f}" y="{bottom + 18}" text-anchor="middle">{tick_s} s</text>')
    FIGURE.write_text("\n".join(lines) + "\n</svg>\n", encoding="utf-8")
    print(FIGURE.name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    options = parser.parse_args()
    looks, least_m, waits_s = [], [], []
    for seed in (None, *range(options.seeds)):
        with tempfile.TemporaryDirectory() as folder:
            data = flown(seed, Path(folder))
            if seed is None:
                draw(data)
            looks.append(data.counters["companion"]["looks"])
            least_m.append(1.2 - float(data.signals["from_quadrotor"].column("rovio").max()))
            waits_s += responses_s(data)
    print(f"{len(looks)} runs: {min(looks)} to {max(looks)} looks, median {median(looks):g}; {min(least_m):.3f} m to "
          f"the boundary or more; {len(waits_s)} waypoints: median {median(waits_s):.2f} s, longest "
          f"{max(waits_s):.2f} s until it flies there")


if __name__ == "__main__":
    main()
