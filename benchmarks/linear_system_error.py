"""Redraws docs/models/linear_system.svg: the error of one step of linear_system against exact integer arithmetic.

    python -m benchmarks.linear_system_error

Lines are the FMU; crosses are the same step by scipy.linalg.expm of the augmented matrix, with rounding at the addition
of exp(A h) x.
"""

from __future__ import annotations

from fractions import Fraction
from math import log10
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from fmus.build import build_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from tests.fmus.reference import SYSTEMS, exact_step

FIGURE = Path(__file__).parents[1] / "docs" / "models" / "linear_system.svg"
STEPS_NS = [round(10 ** (k / 4)) for k in range(39)]
COLOURS = ("#2471a3", "#c0392b", "#1e8449", "#7d3c98")
EPS, INPUT, FLOOR = 2.0**-52, 0.75, 1e-4


def relative_errors(name: str, h_ns: int) -> tuple[float, float]:
    """Error of (FMU, SciPy) as a share of the bound eps (1 + |A| h) max(|x|)."""
    a, b, x = SYSTEMS[name]
    h = h_ns / 1e9
    exact = exact_step(a, b, x, INPUT, h)
    with Plant(describe(build_model("linear_system")), name,
               {"A": a, "B": [[each] for each in b], "x0": x, "u[1]": INPUT}) as plant:
        plant.advance_to(h_ns)
        ours = plant.output_group(["x[1]", "x[2]"]).read()
    step = expm(np.block([[np.array(a), np.array(b)[:, None]], [np.zeros((1, 3))]]) * h)
    scipys = step[:2, :2] @ np.array(x) + step[:2, 2] * INPUT
    norm_h = max(sum(map(abs, column)) for column in zip(*a, strict=True)) * h
    bound = EPS * (1 + norm_h) * float(max(*map(abs, exact), *map(abs, x)))
    return tuple(float(max(abs(Fraction(float(s)) - e) for s, e in zip(seen, exact, strict=True))) / bound
                 for seen in (ours, scipys))     # type: ignore[return-value]


def main() -> None:
    def at(h_ns: float, error: float) -> tuple[str, str]:
        return f"{70 + 62 * log10(h_ns):.1f}", f"{70 - 60 * log10(max(error, FLOOR)):.1f}"

    lines = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 390" font-family="sans-serif" font-size="13">'
             '<rect width="720" height="390" fill="white"/>'
             '<text x="70" y="20">error of one step / (eps (1 + |A| h) max |x|); lines: the FMU, crosses: scipy</text>']
    for power in range(-4, 1):
        _, y = at(1, 10.0**power)
        lines.append(f'<path d="M70 {y}H680" stroke="{"black" if power == 0 else "#ddd"}"/>'
                     f'<text x="62" y="{y}" dy="4" text-anchor="end">1e{power}</text>')
    for power in range(0, 10, 3):
        x, _ = at(10.0**power, 1)
        lines.append(f'<text x="{x}" y="340" text-anchor="middle">{("1 ns", "1 us", "1 ms", "1 s")[power // 3]}</text>')
    lines.append('<text x="380" y="365" text-anchor="middle">step h</text>')
    for row, (name, colour) in enumerate(zip(SYSTEMS, COLOURS, strict=True)):
        errors = [relative_errors(name, h_ns) for h_ns in STEPS_NS]
        points = " ".join(",".join(at(h_ns, ours)) for h_ns, (ours, _) in zip(STEPS_NS, errors, strict=True))
        crosses = "".join(f"M{x} {y}m-3 -3l6 6m0 -6l-6 6" for x, y in
                          (at(h_ns, scipys) for h_ns, (_, scipys) in zip(STEPS_NS, errors, strict=True)))
        lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
                     f'<path d="{crosses}" stroke="{colour}" stroke-width="0.8" fill="none"/>'
                     f'<text x="{90 + 110 * row}" y="45" fill="{colour}">{name}</text>')
        print(f"{name:12} largest share of the bound: ours {max(o for o, _ in errors):.2f}, "
              f"scipy {max(s for _, s in errors):.2f}")
    FIGURE.write_text("\n".join(lines) + "\n</svg>\n", encoding="utf-8")
    print(FIGURE)


if __name__ == "__main__":
    main()
