"""Redraws docs/models/unicycle.svg: the error of one step of the unicycle against closed forms of the same motion.

    python -m benchmarks.unicycle_error

arc: constant wheel speeds. clothoid: wheel speeds ramp in opposite directions (Fresnel integrals). decay: wheel speeds
approach one speed from both sides (sine and cosine integrals). Crosses: SciPy's DOP853 at tolerances of 1e-12.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable
from math import exp, log10, pi, sqrt
from pathlib import Path

import numpy as np
from scipy.special import fresnel, sici

from fmus.build import build_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from tests.fmus.reference import unicycle_at

FIGURE = Path(__file__).parents[1] / "docs" / "models" / "unicycle.svg"
STEPS_NS = [round(10 ** (6 + k / 8)) for k in range(29)]
RADIUS, TRACK, TAU, ACCEL, FLOOR = 0.1, 0.5, 0.1, 0.2, 1e-19
PLAIN = {"wheel_radius_m": RADIUS, "track_m": TRACK, "gain_left": 1.0, "gain_right": 1.0, "slip_left": 0.0,
         "slip_right": 0.0, "icr_x_m": 0.0, "speed_max_mps": 0.0, "accel_max_mps2": 0.0, "tau_wheel_s": 0.0}


def arc(h: float) -> complex:
    """v = 0.5 m/s, omega = 1.2 rad/s."""
    return 0.5 * h * cmath.exp(0.6j * h) * float(np.sinc(0.6 * h / pi))


def clothoid(h: float) -> complex:
    """v = 0.4 m/s, omega = 0.8 - 2 ACCEL / TRACK t."""
    omega, alpha = RADIUS * 4.0 / TRACK, -2 * ACCEL / TRACK
    since, scale = omega / alpha, sqrt(-alpha / pi)
    (sine, cosine) = np.diff(fresnel(np.array([since, h + since]) * scale))[:, 0] / scale
    return complex(0.4 * cmath.exp(-1j * omega**2 / (2 * alpha)) * (cosine - 1j * sine))


def decay(h: float) -> complex:
    """v = 0.5 m/s, omega = 1.2 exp(-t / TAU) rad/s."""
    swing = 1.2 * TAU
    sines, cosines = sici(np.array([swing * exp(-h / TAU), swing]))
    return complex(0.5 * TAU * cmath.exp(1j * swing) * (cosines[1] - cosines[0] - 1j * (sines[1] - sines[0])))


CASES: dict[str, tuple[str, Callable[[float], complex], dict[str, float], tuple[float, ...]]] = {
    "arc": ("#2471a3", arc, {}, (2.0, 8.0, 2.0, 8.0)),
    "clothoid": ("#c0392b", clothoid, {"accel_max_mps2": ACCEL}, (2.0, 6.0, 99.0, -99.0)),
    "decay": ("#1e8449", decay, {"tau_wheel_s": TAU}, (2.0, 8.0, 5.0, 5.0)),
}


def errors(name: str, h_ns: int) -> tuple[float, float]:
    """Distance [m] from the closed form of (FMU, SciPy) after one step."""
    _, exact, changed, (left, right, u_left, u_right) = CASES[name]
    parameters = {**PLAIN, **changed}
    with Plant(describe(build_model("unicycle")), name, {**parameters, "wheel_left": left, "wheel_right": right,
                                                         "u_left": u_left, "u_right": u_right}) as plant:
        plant.advance_to(h_ns)
        x, y = plant.output_group(["x", "y"]).read()
    solved = unicycle_at({**parameters, "tau_wheel_s": changed.get("tau_wheel_s", 1e-3)},
                         np.array([0, 0, 0, left, right, 0, 0]), (u_left, u_right), h_ns / 1e9)
    true = exact(h_ns / 1e9)
    return abs(complex(x, y) - true), abs(complex(solved[0], solved[1]) - true)


def main() -> None:
    def at(h_ns: float, error: float) -> tuple[str, str]:
        return f"{70 + 170 * (log10(h_ns) - 6):.1f}", f"{60 - 30 * (log10(max(error, FLOOR)) + 10):.1f}"

    lines = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 400" font-family="sans-serif" font-size="13">'
             '<rect width="720" height="400" fill="white"/>'
             '<text x="70" y="20">error of one step in m; lines: the FMU, crosses: DOP853 at 1e-12</text>']
    for power in range(-19, -9, 3):
        _, y = at(1e6, 10.0**power)
        lines.append(f'<path d="M70 {y}H680" stroke="#ddd"/>'
                     f'<text x="62" y="{y}" dy="4" text-anchor="end">1e{power}</text>')
    for power, word in ((6, "1 ms"), (7, "10 ms"), (8, "0.1 s"), (9, "1 s")):
        lines.append(f'<text x="{at(10.0**power, 1)[0]}" y="360" text-anchor="middle">{word}</text>')
    lines.append('<text x="380" y="385" text-anchor="middle">step h</text>')
    for row, (name, (colour, *_)) in enumerate(CASES.items()):
        found = [errors(name, h_ns) for h_ns in STEPS_NS]
        points = " ".join(",".join(at(h_ns, ours)) for h_ns, (ours, _) in zip(STEPS_NS, found, strict=True))
        crosses = "".join(f"M{x} {y}m-3 -3l6 6m0 -6l-6 6" for x, y in
                          (at(h_ns, scipys) for h_ns, (_, scipys) in zip(STEPS_NS, found, strict=True)))
        lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
                     f'<path d="{crosses}" stroke="{colour}" stroke-width="0.8" fill="none"/>'
                     f'<text x="{90 + 110 * row}" y="45" fill="{colour}">{name}</text>')
        print(f"{name:9} largest error: ours {max(o for o, _ in found):.1e} m, scipy {max(s for _, s in found):.1e} m")
    FIGURE.write_text("\n".join(lines) + "\n</svg>\n", encoding="utf-8")
    print(FIGURE.name)


if __name__ == "__main__":
    main()
