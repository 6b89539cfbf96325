"""Draws `outputs.svg`: the signal of the scenario's question, or else the outputs, over time with switching instants.

    python -m experiments.show.report.picture RUN_DIR [FILE.svg]

The SVG file of some 50 kB follows the reader's light or dark scheme and needs no plotting library.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from experiments.judge.run_data import RunData, load_run
from experiments.show.report.palette import CARD, CURVES, SWITCHED
from experiments.show.report.question_first import question_signals
from experiments.show.report.series import OUTPUT, Json, switching
from experiments.show.report.thinning import keep

WIDTH, HEIGHT = 900, 400
LEFT, RIGHT, TOP, BOTTOM = 62, 16, 62, 48
MOST_POINTS = 700
LONGEST_TITLE = 105
CHARACTER = 7.3         # width of one at the font size of the legend, in px


def write_picture(run_dir: Path, path: Path | None = None) -> Path:
    path = path or run_dir / "outputs.svg"
    path.write_text(draw(load_run(run_dir)), encoding="utf-8")
    return path


def draw(data: RunData) -> str:
    asked = question_signals(data)
    chosen = asked or [(node, name, unit, table) for node, table in sorted(data.signals.items())
                       for name, unit in zip(table.names, table.units, strict=True)
                       if OUTPUT.fullmatch(name) and table.time_ns.size]
    curves = [(node, name, unit, table.time_ns * 1e-9, table.column(name)) for node, name, unit, table in chosen]
    one_node, one_name = (len({curve[place] for curve in curves}) == 1 for place in (0, 1))
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
        lines.append({"label": node if one_name else name if one_node else f"{node}.{name}", "hue": k % len(CURVES),
                      "points": " ".join(f"{x(float(time_s[i]))},{y(float(values[i]))}" for i in kept)})
    instants = sorted({instant for medium in switching(data)["media"].values() for instant in medium})
    environment = Environment(loader=PackageLoader("experiments.show.report", "page"), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("outputs.svg.j2").render(
        width=WIDTH, height=HEIGHT, left=LEFT, right=WIDTH - RIGHT, top=TOP, bottom=HEIGHT - BOTTOM, lines=lines,
        title=title(data),
        across=[(x(tick), f"{tick:g}") for tick in across if tick <= end_s], up=[(y(tick), f"{tick:g}") for tick in up],
        switches=[x(instant) for instant in instants if instant <= end_s],
        label=label([(name, unit) for _, name, unit, *_ in curves],
                    "output " if not asked else f"{curves[0][0]}: " if one_node and not one_name else ""),
        legend=legend(lines, room=WIDTH - LEFT - RIGHT - (112 if instants else 0)),
        colours=[("curve-" + str(k), pair) for k, pair in enumerate(CURVES)] + [("switched", SWITCHED)], card=CARD)


def legend(lines: list[Json], room: float) -> list[tuple[float, Json]]:
    """Return (x, line) of the first lines whose names fit into one row."""
    placed: list[tuple[float, Json]] = []
    at = float(LEFT)
    for line in lines:
        width = 26 + CHARACTER * len(line["label"]) + 16
        if at + width - 16 > LEFT + room:
            break
        placed.append((round(at, 1), line))
        at += width
    return placed


def title(data: RunData) -> str:
    """Return the scenario's question if it fits into one line, else the scenario's name."""
    question = data.scenario.get("question") or ""
    return question if 0 < len(question) <= LONGEST_TITLE else data.scenario.get("name") or ""


def label(shown: list[tuple[str, str]], before: str) -> str:
    """Return the names and units of the vertical axis: "output y [-]", "drive_fast, drive_slow [m]"."""
    if not shown:
        return "no outputs recorded"
    names, units = (", ".join(dict.fromkeys(words)) for words in zip(*shown, strict=True))
    return f"{before}{names} [{'-' if units == '1' else units}]"


def ticks(low: float, high: float, most: int) -> list[float]:
    """Return at most about `most` round numbers that enclose [low, high], 1, 2 or 5 times a power of ten apart.

    A range that is too narrow for floating-point numbers counts as a single value.
    """
    size = max(abs(low), abs(high))
    spread = high - low if high - low > 1e-9 * size else size or 1.0
    power = 10 ** math.floor(math.log10(spread / most))
    step = next(step for step in (power, 2 * power, 5 * power, 10 * power) if step * most >= spread * 0.999)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [k * step for k in range(first, max(last, first + 1) + 1)]


if __name__ == "__main__":
    print(write_picture(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None))
