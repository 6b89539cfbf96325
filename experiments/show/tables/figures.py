"""Figures 3.5, 3.6 and 3.8 on one page that opens without a network: paths with estimates, and errors in time.

Each figure shows one run, the first of those that the tables average; the statistics above an error curve are those of
50 runs. The page has its numbers as JSON and draws them with the installed Plotly, as the report of a run does.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from agents.estimation.monte_carlo import FILTERS, Build, circle, errors_m, follow
from agents.estimation.paths import PATHS, STEP_NS, Floats
from agents.pursuit.sampling import FIRST_LOOKS
from agents.pursuit.section_3_3 import TABLE_ZETA_M, run
from experiments.show.report.plotly_file import plotly_source

Json = dict[str, Any]
STATISTICS_RUNS = 50
DRAWN_RUNS = 4 * STATISTICS_RUNS
DIGITS = 5


class Drawn(NamedTuple):
    """The curves of one run."""

    target: Floats              # shape (n, 2) [m]
    expected: Floats
    seen: Floats                # shape (k, 2)
    errors_m: Floats
    t_s: Floats


def write_figures(path: Path, progress: Callable[[], None]) -> Path:
    path.write_text(render(figures(progress)), encoding="utf-8")
    return path


ABOUT = ("Figures 3.5, 3.6 and 3.8", "Estimates of a target that is seen now and then, and where it really was.",
         "The dissertation prints neither paths nor tunings: these were fitted to its tables.")


def figures(progress: Callable[[], None]) -> list[Json]:
    steady, winding = circle(17), circle(3)
    return [
        _plane("3.5 (a)", "Circular path, periodic filter, 17 detections", _periodic("circle", steady, 17)),
        _plane("3.5 (b)", "Circular path, adaptive filter", _adaptive("circle")),
        _plane("3.6 (a)", "Zig-zag path, periodic filter, 100 detections", _periodic("zig-zag", winding, 100)),
        _plane("3.6 (b)", "Zig-zag path, adaptive filter", _adaptive("zig-zag")),
        _plane("3.6 (c)", "Zig-zag path, unscented Kalman filter, 25 detections",
               _periodic("zig-zag", FILTERS["UKF"], 25, first=1)),
        _plane("3.6 (d)", "Zig-zag path, particle filter, 25 detections",
               _periodic("zig-zag", FILTERS["PF"], 25, first=1)),
        *(_error(f"3.8 ({part})", f"Circular path, periodic filter, 100 detections, rho = {rho_m:g} m, Gamma = 17",
                 _periodic("circle", circle(17, rho_m=rho_m), 100),
                 errors_m(circle(17, rho_m=rho_m), PATHS["circle"](), 100, STATISTICS_RUNS, first=FIRST_LOOKS,
                          progress=progress)) for part, rho_m in (("a", 0.1), ("b", 0.3))),
        *(_error(f"3.8 ({part})", f"Zig-zag path, adaptive filter, rho = {rho_m:g} m, Gamma = 3",
                 _adaptive("zig-zag", rho_m), _adaptive_errors(rho_m, progress))
          for part, rho_m in (("c", 0.1), ("d", 0.3)))]


def render(drawn: list[Json], about: tuple[str, str, str] = ABOUT) -> str:
    """Return the page; `about` has its heading, what the figures show, and a remark."""
    environment = Environment(loader=PackageLoader("experiments.show.tables", "page"), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    of_reports = files("experiments.show.report") / "page"
    script = [of_reports / "script" / "4_heights.js", files("experiments.show.tables") / "page" / "figures.js"]
    return environment.get_template("figures.html.j2").render(
        figures=drawn, heading=about[0], about=about[1], remark=about[2],
        data_json=Markup(msgspec.json.encode(drawn).decode().replace("<", "\\u003c")),
        plotly=Markup(plotly_source()),
        style=Markup((of_reports / "report.css").read_text("utf-8")),
        script=Markup("\n".join(part.read_text("utf-8") for part in script)))


def _periodic(path_name: str, build: Build, detections: int, first: int = FIRST_LOOKS) -> Drawn:
    path = PATHS[path_name]()
    found = follow(build, path, detections, np.random.default_rng((0, 0)), first=first)
    t_s: Floats = np.arange(path.x.size, dtype=np.float64) * (STEP_NS * 1e-9)
    return Drawn(np.stack([path.x, path.y], axis=1), found.expected, found.detections[:, 1:], found.errors_m, t_s)


def _adaptive(path_name: str, rho_m: float = 0.2) -> Drawn:
    trace = run(path_name, TABLE_ZETA_M, 0, sure=False, rho_m=rho_m, traced=True).trace
    target, expected = np.array([step.target for step in trace]), np.array([step.expected for step in trace])
    seen = np.array([step.seen for step in trace if step.seen is not None])
    t_s = np.array([step.t_ns for step in trace]) * 1e-9
    return Drawn(target, expected, seen, np.hypot(*(expected - target).T), t_s)


def _adaptive_errors(rho_m: float, progress: Callable[[], None]) -> Floats:
    found = []
    for seed in range(STATISTICS_RUNS):
        found.append(run("zig-zag", TABLE_ZETA_M, seed, sure=False, rho_m=rho_m).error_m)
        progress()
    return np.array(found)


def _plane(number: str, title: str, drawn: Drawn) -> Json:
    note = f"{len(drawn.seen)} detections, RMSE {float(np.sqrt(np.mean(drawn.errors_m ** 2))):.3f} m"
    return {"kind": "plane", "number": number, "title": title, "note": note, "target": _xy(drawn.target),
            "expected": _xy(drawn.expected), "seen": _xy(drawn.seen)}


def _error(number: str, title: str, drawn: Drawn, errors: Floats) -> Json:
    note = (f"{len(errors)} runs: RMSE {errors.mean():.4f} m, variance {errors.var(ddof=1):.2g}; drawn: the first, "
            f"with {len(drawn.seen)} detections")
    return {"kind": "error", "number": number, "title": title, "note": note,
            "t_s": [round(t, DIGITS) for t in drawn.t_s.tolist()],
            "error_m": [round(error, DIGITS) for error in drawn.errors_m.tolist()]}


def _xy(places: Floats) -> Json:
    return {"x": [round(x, DIGITS) for x in places[:, 0].tolist()],
            "y": [round(y, DIGITS) for y in places[:, 1].tolist()]}
