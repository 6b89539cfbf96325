"""Which chapter a table's number belongs to: its table, and the page of its figures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from experiments.show.tables import Table


class Figures(NamedTuple):
    steps: int                                              # calls of `progress`
    write: Callable[[Path, Callable[[], None]], Path]


def table_of(number: str) -> Table:
    if number.startswith("5."):
        from experiments.show.tables import chapter_5  # late: a chapter imports what it computes with

        return chapter_5.TABLES[number]
    from experiments.show.tables import chapter_3

    return chapter_3.TABLES[number]


def figures_of(number: str) -> Figures:
    if number.startswith("5."):
        from experiments.show.tables import figures_5

        return Figures(figures_5.STEPS, figures_5.write_figures)
    from experiments.show.tables import figures

    return Figures(figures.DRAWN_RUNS, figures.write_figures)
