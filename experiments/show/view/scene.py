"""What a view shows that does not change in the run: names, ground, zones, colours, and the form for faults."""

from __future__ import annotations

from typing import Any

from experiments.scenario.model import Scenario
from experiments.show.report.palette import FATES, for_page
from experiments.show.report.plane import drawn_ground, views_of
from experiments.show.view.fault_form import fault_form
from netem.faults import Site

Json = dict[str, Any]


def scene_of(scenario: Scenario, site: Site, folder: str, *, real_time: bool) -> Json:
    resolved = scenario.resolved()
    plans = [plan for medium in resolved["media"].values() if (plan := medium["floor_plan"]) is not None]
    ground = resolved["ground"]
    return {
        "name": scenario.name, "question": scenario.question, "seed": scenario.seed, "folder": folder,
        "end_ns": scenario.length_ns, "real_time": real_time, "palette": for_page(),
        "fates": {fate.value: fate.meaning for fate in FATES},
        "arrived": [fate.value for fate in FATES if fate.arrived],
        "unseen": [fate.value for fate in FATES if fate.unseen],
        "nodes": [{"name": name, "program": agent.program, "at": None if agent.at_m is None else [*agent.at_m][:2]}
                  for name, agent in scenario.agents.items()]
        + [{"name": name, "program": gateway.kind, "at": None} for name, gateway in scenario.gateways.items()],
        "media": {name: medium.kind for name, medium in scenario.media.items()},
        "ground": None if ground is None else drawn_ground(ground),
        "zones": [{"medium": name, "corners": area.outline_m()} for name, medium in scenario.media.items()
                  for area in medium.settings.weak_areas()],
        "views": [view for plan in plans for view in views_of(plan)],
        "obstacles": [{"at": obstacle["at_m"], "radius_m": obstacle["radius_m"]}
                      for plan in plans for obstacle in plan["obstacles"]],
        "faults": fault_form(site)}
