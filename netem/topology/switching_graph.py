"""A directed graph that switches between named graphs by a schedule, once or periodically.

The graph at the start of a frame decides its receivers; a switch while the frame is on the air does not change them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

from netem.core.nearest import did_you_mean
from netem.topology import Graph, Site, TopologyError, TopologyKind
from netem.topology.fixed_graph import graph_of
from netem.topology.timetable import Timetable


@dataclass(frozen=True)
class GraphChange:
    at_ns: int
    graph: str


@dataclass(frozen=True)
class SwitchingGraph(TopologyKind):
    kind: Literal["switching"]
    graphs: dict[str, tuple[str, ...]]              # name -> links
    schedule: tuple[GraphChange, ...]
    repeat_ns: int | None = None                    # the schedule starts again at every multiple; None: it runs once
    level_dbm: float = -60.0
    levels_dbm: dict[str, float] = field(default_factory=dict)

    def over(self, site: Site) -> Timetable:
        problems: list[str] = []
        graphs: dict[str, Graph] = {}
        for name, links in self.graphs.items():
            graphs[name], wrong = graph_of(links, self.level_dbm, self.levels_dbm, site)
            problems.extend(f"graphs.{name}: {problem}" for problem in wrong)
        problems += self._schedule_problems()
        if problems:
            raise TopologyError("\n".join(problems))
        return Timetable([change.at_ns for change in self.schedule],
                         [graphs[change.graph] for change in self.schedule], self.repeat_ns, at_m=site.at_m)

    def _schedule_problems(self) -> list[str]:
        problems = []
        for index, change in enumerate(self.schedule):
            if change.graph not in self.graphs:
                hint = did_you_mean(change.graph, self.graphs, f"the graphs are {', '.join(self.graphs)}")
                problems.append(f"schedule[{index}].graph={change.graph!r}: no such graph: {hint}")
        if not self.schedule or self.schedule[0].at_ns != 0:
            problems.append("schedule: expected a first entry with at_ns = 0, the graph at the start")
        problems.extend(f"schedule[{index + 1}].at_ns={later.at_ns}: expected later than the one before "
                        f"({earlier.at_ns})" for index, (earlier, later) in enumerate(pairwise(self.schedule))
                        if later.at_ns <= earlier.at_ns)
        if self.repeat_ns is not None and self.schedule and self.repeat_ns <= self.schedule[-1].at_ns:
            problems.append(f"repeat_ns={self.repeat_ns}: expected later than the last change "
                            f"({self.schedule[-1].at_ns})")
        return problems
