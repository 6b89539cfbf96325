"""The tables of Chapter 3 by number."""

from __future__ import annotations

from experiments.show.tables import Table
from experiments.show.tables.estimation import AdaptiveFilter, FilterErrors
from experiments.show.tables.step_time import StepTime

TABLES: dict[str, Table] = {
    "3.1": FilterErrors("circle", "Table 3.1: filters on the circular path"),
    "3.2": AdaptiveFilter("circle", "Table 3.2: the adaptive filter on the circular path"),
    "3.3": FilterErrors("zig-zag", "Table 3.3: filters on the zig-zag path"),
    "3.4": AdaptiveFilter("zig-zag", "Table 3.4: the adaptive filter on the zig-zag path"),
    "3.5": StepTime(),
}
