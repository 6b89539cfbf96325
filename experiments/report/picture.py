"""`outputs.svg`: the outputs of a run over time with its switching instants, for a page that shows pictures only.

    python -m experiments.report.picture RUN_DIR [FILE.svg]

An SVG file of some 50 kB, readable on light and dark pages; it needs no browser and no plotting library.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from experiments.report.series import OUTPUT, Json, switching
from experiments.report.thinning import keep
from experiments.run_data import RunData, load_run

WIDTH, HEIGHT = 900, 400
LEFT, RIGHT, TOP, BOTTOM = 62, 16, 62, 48
HUES = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#8c8c8c")
MOST_POINTS = 700
LONGEST_TITLE = 105


def write_picture(run_dir: Path, path: Path | None = None) -> Path:
    path = path or run_dir / "outputs.svg"
    path.write_text(draw(load_run(run_dir)), encoding="utf-8")
    return path


def draw(data: RunData) -> str:
    curves = [(node, name, table.units[k], table.time_ns * 1e-9, table.values[:, k])
              for node, table in sorted(data.signals.items()) for k, name in enumerate(table.names)
              if OUTPUT.fullmatch(name) and table.time_ns.size]
    several = len({name for _, name, *_ in curves}) > 1
    finite = [value for *_, values in curves for value in values.tolist() if math.isfinite(value)]
    end_s = max(data.length_ns * 1e-9, 1e-9)
    across, up = ticks(0.0, end_s, 14), ticks(min(finite, default=0.0), max(finite, default=1.0), 6)

    def x(time_s: float) -> float:
        return round(LEFT + time_s / end_s * (WIDTH - LEFT - RIGHT), 2)

    def y(value: float) -> float:
        return round(HEIGHT - BOTTOM - (value - up[0]) / (up[-1] - up[0]) * (HEIGHT - TOP - BOTTOM), 2)

    lines: list[Json] = []
    for k, (node, name, _, time_s, values) in enumerate(curves):
        kept = [i for i in keep(values, MOST_POINTS).tolist() if math.isfinite(values[i])]
        lines.append({"label": f"{node}.{name}" if several else node, "hue": HUES[k % len(HUES)],
                      "points": " ".join(f"{x(float(time_s[i]))},{y(float(values[i]))}" for i in kept)})
    instants = sorted({instant for medium in switching(data)["media"].values() for instant in medium})
    environment = Environment(loader=PackageLoader("experiments.report", "page"), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("outputs.svg.j2").render(
        width=WIDTH, height=HEIGHT, left=LEFT, right=WIDTH - RIGHT, top=TOP, bottom=HEIGHT - BOTTOM, lines=lines,
        title=title(data),
        across=[(x(tick), f"{tick:g}") for tick in across if tick <= end_s], up=[(y(tick), f"{tick:g}") for tick in up],
        switches=[x(instant) for instant in instants if instant <= end_s],
        label=label(curves[0][1:3] if curves else None))


def title(data: RunData) -> str:
    """The scenario's question if one line holds it, else the scenario's name."""
    question = data.scenario.get("question") or ""
    return question if 0 < len(question) <= LONGEST_TITLE else data.scenario.get("name") or ""


def label(output: tuple[str, str] | None) -> str:
    if output is None:
        return "no outputs recorded"
    name, unit = output
    return f"output {name} [{'-' if unit == '1' else unit}]"


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers 1, 2 or 5 times a power of ten apart that enclose [low, high], about `most` of them or fewer.

    A range too narrow for its floating-point numbers counts as a single value."""
    size = max(abs(low), abs(high))
    spread = high - low if high - low > 1e-9 * size else size or 1.0
    power = 10 ** math.floor(math.log10(spread / most))
    step = next(step for step in (power, 2 * power, 5 * power, 10 * power) if step * most >= spread * 0.999)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [k * step for k in range(first, max(last, first + 1) + 1)]


if __name__ == "__main__":
    print(write_picture(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None))
