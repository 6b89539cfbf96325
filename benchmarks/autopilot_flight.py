"""Redraw docs/models/autopilot.svg: attitude, height and heading of the Hummingbird while it tracks waypoints.

    python -m benchmarks.autopilot_flight

As Figure 3.11 of Tolic 2012: waypoints come one after the other, height and heading are held. The flight controller
runs on its board, the plant is the FMU, motion capture has 100 frames a second, 1 mm of noise and 8 ms of latency. Also
printed: the error at hover, and what a simulated millisecond of controller and plant costs in processor time.
"""

from __future__ import annotations

from math import degrees, dist, remainder, tau
from pathlib import Path
from random import Random
from time import process_time

from firmware_sim.autopilot.autopilot import Autopilot
from firmware_sim.autopilot.autopilot_settings import AutopilotSettings
from firmware_sim.autopilot.vehicle import Mode, PositionTarget, Vector
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from fmus.build import MODELS, build_model
from fmus.describe import read_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from fmus.presets import read_presets
from netem.media.sensing.sight import Detection, pack_detection
from netem.node.node import Node
from netem.wire.messages import Grant

FIGURE = Path(__file__).parents[1] / "docs" / "models" / "autopilot.svg"
FRAME_NS, LATENCY_NS, NOISE_M = 10_000_000, 8_000_000, 0.001
WAYPOINTS = ((1.0, 0.0), (1.0, 1.0), (0.2, 1.6), (-0.5, 1.0), (-0.5, 0.0), (0.0, 0.0))
EVERY_S, HEIGHT_M, YAW = 2.0, 1.0, tau / 4
ROWS = (("roll, deg", "#2471a3", 15.0), ("pitch, deg", "#c0392b", 15.0), ("north, m", "#8e44ad", 1.2),
        ("height - 1 m, cm", "#1e8449", 2.0), ("heading held, error in deg", "#b9770e", 2.0))


class Flight:
    def __init__(self) -> None:
        folder = MODELS / "quadrotor"
        preset = read_presets(folder, read_model(folder / "variables.toml"))["hummingbird"]
        self.node, self.now_ns = Node("uav", ["mocap"]), 0
        self.plant = Plant(describe(build_model("quadrotor")), "uav", preset.parameters,
                           present=lambda: max(self.node.present_ns(), self.now_ns))
        clock = LocalClock(ClockSettings(), lambda: self.node.now_ns)
        settings = AutopilotSettings(parameters={"LINK_LOSS_ACT": 0.0, "MOCAP_DELAY": LATENCY_NS / 1e9})
        autopilot = Autopilot(Board(self.node, clock, self.plant, {}, Random(1), {}), settings)
        self.controller = autopilot.controller
        self.node.start(autopilot.run())
        self._rng = Random(7)
        self._pose = self.plant.output_group(["x", "y", "z", "roll", "pitch", "heading"])

    def frame(self) -> tuple[float, ...]:
        """One period of motion capture; x, y, z, roll, pitch, heading at its beginning."""
        pose = self._pose.read()
        seen = Detection(self.now_ns, *(each + self._rng.gauss(0.0, NOISE_M) for each in pose[:3]), "uav")
        arrival_ns, next_ns = self.now_ns + LATENCY_NS, self.now_ns + FRAME_NS
        self.node.advance(Grant(0, next_ns, False, True, [(arrival_ns, 0, pack_detection(seen))]))
        self.now_ns = next_ns
        return pose

    def frames(self, seconds: float) -> list[tuple[float, ...]]:
        return [self.frame() for _ in range(round(seconds * 1e9 / FRAME_NS))]

    def ned(self, pose: tuple[float, ...]) -> Vector:
        return pose[1], pose[0], -pose[2]


def main() -> None:
    flight = Flight()
    control = flight.controller
    flight.frames(0.2)
    control.arm()
    control.take_off(HEIGHT_M)
    flight.frames(9.8)
    since = process_time()
    hover = [dist(flight.ned(pose), (0.0, 0.0, -HEIGHT_M)) for pose in flight.frames(20.0)]
    cost_us = (process_time() - since) / 20_000 * 1e6
    rms = (sum(each**2 for each in hover) / len(hover)) ** 0.5
    print(f"hover for 20 s: largest error {max(hover) * 1e3:.2f} mm, rms {rms * 1e3:.2f} mm")
    print(f"controller at 1 kHz, plant and motion capture: {cost_us:.1f} us for a simulated ms, "
          f"{1000 / cost_us:.0f} times real time")

    rows: list[list[float]] = [[], [], [], [], []]
    for north, east in WAYPOINTS:
        for _ in range(round(EVERY_S * 10)):
            control.target(PositionTarget((north, east, -HEIGHT_M), yaw_rad=YAW), flight.now_ns)
            if control.state().mode is not Mode.OFFBOARD:
                control.set_mode(Mode.OFFBOARD)
            for pose in flight.frames(0.1):
                for row, value in zip(rows, (degrees(pose[3]), -degrees(pose[4]), pose[1], (pose[2] - HEIGHT_M) * 100,
                                             degrees(remainder(tau / 4 - pose[5] - YAW, tau))), strict=True):
                    row.append(value)
    _draw(rows)
    print(f"tracking: height within {max(map(abs, rows[3])):.1f} cm, heading within {max(map(abs, rows[4])):.2f} deg")
    flight.plant.close()


def _draw(rows: list[list[float]]) -> None:
    count, width, high = len(rows[0]), 780, 90
    size = high * len(rows) + 60
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 900 {size}" font-family="sans-serif" '
             f'font-size="13"><rect width="900" height="{size}" fill="white"/>']
    for k, ((name, colour, scale), values) in enumerate(zip(ROWS, rows, strict=True)):
        middle = 60 + high * k
        lines.append(f'<path d="M70 {middle}H{70 + width}" stroke="#ddd"/>'
                     f'<text x="75" y="{middle - 32}" fill="{colour}">{name}</text>'
                     f'<text x="62" y="{middle - 26}" text-anchor="end">{scale:g}</text>'
                     f'<text x="62" y="{middle + 36}" text-anchor="end">-{scale:g}</text>')
        points = " ".join(f"{70 + width * i / count:.1f},{middle - 32 * value / scale:.1f}"
                          for i, value in enumerate(values))
        lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.2"/>')
    bottom = 60 + high * len(rows) - 40
    for k in range(len(WAYPOINTS) + 1):
        x = 70 + width * k / len(WAYPOINTS)
        lines.append(f'<path d="M{x:.0f} 20V{bottom}" stroke="#bbb" stroke-dasharray="3 4"/>'
                     f'<text x="{x:.0f}" y="{bottom + 18}" text-anchor="middle">{k * EVERY_S:g} s</text>')
    FIGURE.write_text("\n".join(lines) + "\n</svg>\n", encoding="utf-8")
    print(FIGURE.name)


if __name__ == "__main__":
    main()
