"""Redraws docs/models/quadrotor.svg: error of an aggressive flight of the quadrotor over the length of internal steps.

    python -m benchmarks.quadrotor_error

Half a second with the inputs of fmus/quadrotor/reference.csv is compared with SciPy's DOP853 at tolerances of 1e-12.
Each line is a group of states and shows its largest error at any of the 26 instants; one line shows fourth order.
"""

from __future__ import annotations

from math import log10
from pathlib import Path
from time import perf_counter

import numpy as np

from fmus.build import MODELS, build_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from tests.fmus.reference import cases

FIGURE = Path(__file__).parents[1] / "docs" / "models" / "quadrotor.svg"
STEPS_S = [round(8e-3 / 2 ** (k / 2), 9) for k in range(13)]
GROUPS = {"position [m]": ("#2471a3", range(3)), "velocity [m/s]": ("#c0392b", range(3, 6)),
          "quaternion": ("#1e8449", range(6, 10)), "body rates [rad/s]": ("#8e44ad", range(10, 13))}


def errors(h_max: float) -> np.ndarray:
    """Largest error of each state."""
    case = cases()["quadrotor"]
    expected = np.loadtxt(MODELS / "quadrotor" / "reference.csv", delimiter=",", skiprows=1)[:, 8:]
    with Plant(describe(build_model("quadrotor")), "p", case.start | {"h_max": h_max}) as plant:
        inputs, outputs = plant.input_group(case.input_names), plant.output_group(case.output_names)
        seen = []
        for t_ns, values in zip(case.instants_ns, case.inputs, strict=True):
            plant.advance_to(t_ns)
            inputs.write(values)
            seen.append(outputs.read())
    return np.asarray(np.abs(np.array(seen) - expected).max(axis=0))


def cost_us(h_max: float, step_ns: int = 1_000_000, steps: int = 20_000) -> float:
    """Time in us of setting the inputs, one step, and reading the ten sensor outputs."""
    with Plant(describe(build_model("quadrotor")), "p", {"z": 100.0, "h_max": h_max}) as plant:
        inputs = plant.input_group([f"u[{i}]" for i in range(1, 5)])
        outputs = plant.output_group([*(f"q[{i}]" for i in range(1, 5)), *(f"omega[{i}]" for i in range(1, 4)),
                                      *(f"force[{i}]" for i in range(1, 4))])
        since = perf_counter()
        for k in range(1, steps + 1):
            inputs.write((470.0, 470.0, 470.0, 470.0))
            plant.advance_to(k * step_ns)
            outputs.read()
        return (perf_counter() - since) / steps * 1e6


def main() -> None:
    def at(h_max: float, error: float) -> str:
        return f"{90 + 480 * (log10(h_max) + 4):.1f},{350 - 30 * (log10(error) + 15):.1f}"

    lines = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1060 400" font-family="sans-serif" font-size="13">'
             '<rect width="1060" height="400" fill="white"/>'
             '<text x="90" y="20">largest error in 0.5 s of flight against DOP853 at 1e-12; dashed: order 4</text>']
    for power in range(-15, -5, 3):
        y = at(1e-4, 10.0**power).split(",")[1]
        lines.append(f'<path d="M90 {y}H1020" stroke="#ddd"/>'
                     f'<text x="82" y="{y}" dy="4" text-anchor="end">1e{power}</text>')
    for h_max, word in ((1.25e-4, "0.125 ms"), (5e-4, "0.5 ms"), (1e-3, "1 ms"), (2e-3, "2 ms"), (8e-3, "8 ms")):
        lines.append(f'<text x="{at(h_max, 1).split(",")[0]}" y="375" text-anchor="middle">{word}</text>')
    lines.append('<text x="560" y="393" text-anchor="middle">h_max</text>')
    found = [errors(h_max) for h_max in STEPS_S]
    for row, (name, (colour, states)) in enumerate(GROUPS.items()):
        points = " ".join(at(h_max, max(each[list(states)].max(), 1e-16))
                          for h_max, each in zip(STEPS_S, found, strict=True))
        lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
                     f'<text x="{110 + 160 * row}" y="45" fill="{colour}">{name}</text>')
    lines.append(f'<polyline points="{at(8e-3, 3e-6)} {at(2.5e-4, 3e-6 / 32**4)}" fill="none" stroke="#888" '
                 'stroke-dasharray="6 5"/>')
    for h_max, each in zip(STEPS_S, found, strict=True):
        print(f"h_max {h_max * 1e3:6.3f} ms   largest error {each[:13].max():.1e}")
    print(f"a step of 1 ms at h_max = 1 ms, inputs and ten outputs: {cost_us(1e-3):.2f} us")
    FIGURE.write_text("\n".join(lines) + "\n</svg>\n", encoding="utf-8")
    print(FIGURE.name)


if __name__ == "__main__":
    main()
