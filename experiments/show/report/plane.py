"""Data of a view from above: bodies, estimates, detections, fields of view and looks, at instants for an animation.

A body is a node, or a [derived.NAME], with a position among its signals (`positions`). `detection_x` and `detection_y`
are the last detection of a node; each new pair is a point.
The ground is what the programs of the run declare (`firmware_sim.ground_plan`).
A look is a copy on a medium with a floor plan, drawn at its exposure at the position of its body. Observers without
requests, as of motion capture, have no looks. If there are too many, looks with the body out of view are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from experiments.judge.run_data import RunData
from experiments.show.positions import places
from experiments.show.report.thinning import keep
from netem.core.fate import Fate
from netem.records.signal_table import SignalTable

Json = dict[str, Any]
MOST_INSTANTS = 240
MOST_ON_GROUND = 600        # of runs whose programs declare the ground: many robots that move at a time
MOST_LOOKS = 5_000
DETECTION = "detection"
ROOM = 0.05         # around the declared area, as a share of its larger side
Picture = tuple[tuple[float, float], tuple[float, float]]
DIGITS = 6          # micrometres


def plane(data: RunData, also_ns: Sequence[int] = ()) -> Json | None:
    """Return paths at common instants, `also_ns` included, fields of view, obstacles and looks, and the ground.

    Where programs declare the ground, bodies outside the picture of its area have no position: a robot that is parked
    there, or carried from there, leaves no path. Returns None if no node records a position.
    """
    tracks = [(node, name, table, columns) for node, table in sorted(data.signals.items()) if table.time_ns.size
              for name, columns in places(table.names, table.units)]
    bodies = [track for track in tracks if not track[1]]
    if not bodies:
        return None
    last_ns = max(data.length_ns, *(int(table.time_ns[-1]) for _, _, table, _ in tracks))
    ground = data.scenario.get("ground")
    instants_ns = np.linspace(0, last_ns, MOST_INSTANTS if ground is None else MOST_ON_GROUND).astype(np.int64)
    instants_ns = np.unique(np.append(instants_ns, np.array(also_ns, dtype=np.int64)).clip(0, last_ns))
    plans = {name: plan for name, medium in (data.scenario.get("media") or {}).items()
             if (plan := medium.get("floor_plan")) is not None}
    carriers = {observer: carrier for plan in plans.values() for observer, carrier in plan["carriers"].items()}
    picture = None if ground is None else _picture(ground)
    return {"instants_s": (instants_ns / 1e9).tolist(), "ground": None if ground is None else drawn_ground(ground),
            "bodies": [_track(node, table, columns, instants_ns, picture) for node, _, table, columns in bodies],
            "believed": [_track(f"{node}: {name}", table, columns, instants_ns) | {"body": carriers.get(node, node)}
                         for node, name, table, columns in tracks if name and name != DETECTION],
            "detections": [_points(node, table, columns) | {"body": carriers.get(node, node)}
                           for node, name, table, columns in tracks if name == DETECTION],
            "views": [view for plan in plans.values() for view in views_of(plan)],
            "obstacles": [{"x": obstacle["at_m"][0], "y": obstacle["at_m"][1], "radius_m": obstacle["radius_m"]}
                          for plan in plans.values() for obstacle in plan["obstacles"]],
            **_looks(data, plans)}


def _picture(ground: Json) -> Picture:
    """Return the sides of the picture: those of the area and some room around it."""
    (west, east), (south, north) = ground["area_x_m"], ground["area_y_m"]
    room = ROOM * max(east - west, north - south)
    return (west - room, east + room), (south - room, north + room)


def drawn_ground(ground: Json) -> Json:
    return {"area": [ground["area_x_m"], ground["area_y_m"]], "picture": _picture(ground),
            "shapes": [{"what": shape["what"], "solid": shape["solid"], "x": [x for x, _ in shape["corners_m"]],
                        "y": [y for _, y in shape["corners_m"]]} for shape in ground["shapes"]]}


def _track(label: str, table: SignalTable, columns: tuple[str, ...], instants_ns: npt.NDArray[np.int64],
           picture: Picture | None = None) -> Json:
    """Return a track with the last sample at or before each instant; None before the first one and out of `picture`."""
    at = np.searchsorted(table.time_ns, instants_ns, side="right") - 1
    there, xs, ys = at >= 0, table.column(columns[0]), table.column(columns[1])
    if picture is not None:
        inside = np.logical_and.reduce([(low <= column) & (column <= high)
                                        for column, (low, high) in zip((xs, ys), picture, strict=True)])
        xs, ys = xs[inside], ys[inside]
        there = there & inside[np.maximum(at, 0)]
    values = [_plain(np.where(there, table.column(name)[np.maximum(at, 0)], np.nan)) for name in columns]
    kept = np.union1d(keep(xs), keep(ys))
    return {"label": label, "x": values[0], "y": values[1], "heading": values[2] if len(values) > 2 else None,
            "path_x": _plain(xs[kept]), "path_y": _plain(ys[kept])}


def _points(node: str, table: SignalTable, columns: tuple[str, ...]) -> Json:
    """Return the instants [s] and values [m] at which the pair changes."""
    xs, ys = table.column(columns[0]), table.column(columns[1])
    new = np.isfinite(xs + ys)
    new[1:] &= (xs[1:] != xs[:-1]) | (ys[1:] != ys[:-1])
    return {"label": node, "t_s": (table.time_ns[new] / 1e9).tolist(), "x": _plain(xs[new]), "y": _plain(ys[new])}


def _plain(values: npt.NDArray[np.float64]) -> list[float | None]:
    return [round(value, DIGITS) if np.isfinite(value) else None for value in values.tolist()]


def views_of(plan: Json) -> Iterator[Json]:
    if plan["range_m"] is not None:
        for observer, carrier in plan["carriers"].items():
            yield {"observer": observer, "carrier": carrier, "range_m": plan["range_m"],
                   "half_angle_deg": plan["half_angle_deg"]}


def _looks(data: RunData, plans: Mapping[str, Json]) -> Json:
    unasked = {(name, receiver) for name, plan in plans.items() for receiver in plan["unasked"]}
    asked = np.array([medium in plans and (medium, receiver) not in unasked
                      for medium, _, receiver in data.ledger.link.names], dtype=np.bool_)
    if not asked.any():
        return {"looks": [], "looks_total": 0}
    copies = data.ledger.taken(asked[data.ledger.link.codes])
    shown = copies.taken(np.argsort(copies.ints("offered_ns"), kind="stable"))
    if len(copies) > MOST_LOOKS:
        shown = shown.taken(np.flatnonzero(~shown.fate.among(Fate.OUT_OF_VIEW.value))[:MOST_LOOKS])
    places: dict[str, Json] = {}
    looks = []
    times = shown.ints("offered_ns")
    for row, ((_, sender, receiver), fate) in enumerate(zip(shown.link.values(), shown.fate.values(), strict=True)):
        table = data.signals.get(sender)
        if table is None or not {"x", "y"} <= set(table.names):
            continue
        if sender not in places:
            places[sender] = _track(sender, table, ("x", "y"), times)
        looks.append({"t_s": int(times[row]) / 1e9, "observer": receiver, "body": sender, "fate": fate,
                      "seen": Fate(fate).arrived, "unseen": Fate(fate).unseen,
                      "x": places[sender]["x"][row], "y": places[sender]["y"][row]})
    return {"looks": looks, "looks_total": len(copies)}
