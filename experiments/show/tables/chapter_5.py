"""The tables of Chapter 5 by number. The dissertation prints none: the numbers are ours, the figures its sentences."""

from __future__ import annotations

from experiments.show.tables import Table
from experiments.show.tables.optimal_triggering import CAPS, F1, F2, F3, Entries

JUDGED_BY = "Judged by bands around figures that were computed independently; the dissertation prints no table."

TABLES: dict[str, Table] = {
    "5.1": Entries("Table 5.1: largest intervals and running costs", JUDGED_BY, CAPS),
    "5.2": Entries("Table 5.2: F1, discounted per look as printed: V* = S / (1 - gamma), tau* = 0", JUDGED_BY, F1),
    "5.3": Entries("Table 5.3: F2, discounted per second: tau* = tau_max", JUDGED_BY, F2),
    "5.4": Entries("Table 5.4: F3, the long-run mean: S decides", JUDGED_BY, F3),
}
