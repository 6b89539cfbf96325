"""What a Marco Polo game costs as it grows: `python -m benchmarks.marco_polo_scale [GAMES] [LENGTH_S] [all]`.

Games of 5, 10, 20 and 40 sensors, half as many targets, and 22.5 m^2 of area for each sensor, so that the density of
robots is that of 40 sensors on 30 x 30 m. A fifth of the sensors are UAVs. All hear each other on the radio. Prints for
each size, in medians over GAMES seeds (3): processor time of the run's loop for each robot and simulated second, the
number of frames, how many nodes had each in range, and the processor time for each frame. Frames are those of the
radios, and the exposures of each body, which cost whether somebody has it in view or not. With `all` the cameras record
every pair of camera and body, in range or not.
"""

from __future__ import annotations

import sys
import tempfile
from math import ceil, sqrt
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

from experiments.run.network import Network
from experiments.run.runner import run
from experiments.scenario.loader import load_tables
from netem.records.ledger_file import read_ledger

SIZES = (5, 10, 20, 40)
AREA_M2 = 22.5                  # for each sensor
CELL_M = 0.5
EXPOSURE_S = 0.1
VIEWS = {"view_uav": 1.5, "view_ugv": 1.0}
ENTER_S = 1.0                   # of the first target; the others follow one second apart


def game(sensors: int, targets: int, seed: int = 1, length_s: float = 60.0, side_m: float | None = None,
         **sensing: Any) -> dict[str, Any]:
    """Return the tables of a scenario; `side_m` of the square area is by default the one of this benchmark's density.

    `sensing` are further keys of the cameras' media."""
    side_m = round(sqrt(AREA_M2 * sensors) / CELL_M) * CELL_M if side_m is None else side_m
    uavs = [f"uav_{number}" for number in range(1, sensors // 5 + 1)]
    ugvs = [f"ugv_{number}" for number in range(1, sensors - len(uavs) + 1)]
    evaders = [f"target_{number}" for number in range(1, targets + 1)]
    rows = ceil(sqrt(sensors))
    # every fifth place of a grid is a UAV's
    places = [((0.5 + number % rows) * side_m / rows, (0.5 + number // rows) * side_m / ceil(sensors / rows))
              for number in range(sensors)]
    aerial = places[2::5][:len(uavs)]
    ground = [place for place in places if place not in aerial]
    view = {**dict.fromkeys(uavs, "view_uav"), **dict.fromkeys(ugvs, "view_ugv")}
    slot_ms, most_tasks = 5, 3
    window_ms = 2 * (2 * sensors * slot_ms + slot_ms) + 5
    agents: dict[str, Any] = {}
    for name, (x, y) in zip([*uavs, *ugvs], [*aerial, *ground], strict=True):
        ugv = name in ugvs
        agents[name] = {
            "program": f"agents.marco_polo_game.sensor_robot:{'UgvRobot' if ugv else 'UavRobot'}",
            "parameters": {"view": view[name], "exposure_ms": EXPOSURE_S * 1000, "slot_ms": slot_ms,
                           "window_ms": window_ms,
                           "max_successive_losses": 1, "most_tasks": most_tasks},
            "media": ["radio", view[name], *(["grip"] if ugv else [])],
            "plant": {"fmu": "omnidirectional", "parameters": {"x": x, "y": y}}}
    for number, name in enumerate(evaders):
        agents[name] = {
            "program": "agents.marco_polo_game.target_robot:TargetRobot",
            "parameters": {"enter_s": ENTER_S + number}, "media": [*VIEWS, "grip"],
            "plant": {"fmu": "omnidirectional", "parameters": {"x": -5.0, "y": 0.5 + number}}}
    pose = ["x", "y", "theta"]
    media: dict[str, Any] = {medium: {
        "kind": "sensing", "exposure_period_ms": EXPOSURE_S * 1000, "latency_ms": 20, "range_m": range_m,
        "bodies": dict.fromkeys([*(name for name in view if view[name] == medium), *evaders], pose),
        "every_exposure_to": [name for name in view if view[name] == medium], "record_out_of_view": False, **sensing}
        for medium, range_m in VIEWS.items()}
    media["radio"] = {"kind": "broadcast_radio", "preset": "wifi_broadcast_80211b_1mbps"}
    media["grip"] = {"kind": "broadcast_radio", "preset": "wifi_broadcast_80211b_1mbps", "decode": "local"}
    return {"seed": seed, "length_s": length_s, "sample_period_ms": 100,
            "team": {"sensors": [*uavs, *ugvs], "targets": evaders, "ugvs": ugvs, "area_x_m": [0.0, side_m],
                     "area_y_m": [0.0, side_m],
                     "radius_m": {name: VIEWS[view[name]] for name in view},
                     "game": {"cell_m": CELL_M, "least_area_coverage": 0.1}},
            "agents": agents, "media": media}


def cost(tables: dict[str, Any]) -> tuple[float, int, int]:
    """Run it; return the processor time [s] of its loop, its frames, and the copies of frames that were in range."""
    spent: list[float] = []
    observe, finish = Network.observe, Network.finish

    def begin(self: Network, *given: Any) -> Any:
        found = observe(self, *given)
        spent.append(process_time())
        return found

    def end(self: Network, *given: Any) -> Any:
        spent.append(process_time())
        return finish(self, *given)

    Network.observe, Network.finish = begin, end       # type: ignore[method-assign]
    try:
        with tempfile.TemporaryDirectory() as folder:
            scenario = load_tables(tables, "what does it cost?", Path(folder) / "game.toml")
            run(scenario, host="inline", out=Path(folder) / "run", report=False)
            copies = read_ledger(Path(folder) / "run" / "ledger.parquet", ["medium", "sender", "number"]).to_pylist()
    finally:
        Network.observe, Network.finish = observe, finish   # type: ignore[method-assign]
    sent = {tuple(row.values()) for row in copies if row["medium"] not in VIEWS}
    exposures = sum(len(tables["media"][view]["bodies"]) for view in VIEWS) * tables["length_s"] / EXPOSURE_S
    return spent[1] - spent[0], len(sent) + round(exposures), len(copies)


def main(games: int = 3, length_s: float = 60.0, record: str = "") -> None:
    keys = {"record_out_of_view": record == "all"}
    print("sensors targets  us/robot/s   frames  in range  us/frame")
    for sensors in SIZES:
        costs = [cost(game(sensors, sensors // 2, seed, length_s, **keys)) for seed in range(1, games + 1)]
        robots = sensors + sensors // 2
        each = [median(column) for column in zip(*[(spent / robots / length_s * 1e6, frames, copies / frames,
                                                    spent / frames * 1e6)
                                                   for spent, frames, copies in costs], strict=True)]
        print(f"{sensors:7d}{sensors // 2:8d}{each[0]:12.0f}{each[1]:9.0f}{each[2]:10.2f}{each[3]:10.1f}", flush=True)


if __name__ == "__main__":
    main(*(kind(value) for kind, value in zip((int, float, str), sys.argv[1:], strict=False)))
