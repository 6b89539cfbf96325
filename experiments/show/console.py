"""The console of the commands: rich on a terminal, plain lines in a file or a pipe.

A file or a pipe needs no widths, bold type or progress bars, and importing rich takes a tenth of the time of
`marconet check`. Plain lines are never folded, so that each row of a table can be searched for.

`NO_COLOR` (any value that is not empty) removes colours; `FORCE_COLOR` selects a terminal's output in a pipe.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import TypeAlias

    from rich.console import Console as RichConsole

    Console: TypeAlias = "RichConsole | PlainConsole"


class PlainConsole:
    """The part of rich's `Console` that the commands use, as plain text on standard output."""

    is_terminal = False

    def print(self, text: str = "", *, soft_wrap: bool = True) -> None:
        print(text, flush=True)

    @contextmanager
    def status(self, text: str) -> Iterator[None]:
        """Print the activity that the command waits for; rich shows it only during the `with` block."""
        self.print(text)
        yield


class Silent(PlainConsole):
    """A console that prints nothing, for `--quiet` and `--json`."""

    def print(self, text: str = "", *, soft_wrap: bool = True) -> None:
        """Drop `text`."""


def console_for(stdout_is_for_people: bool = True) -> Console:
    """Return the console of standard output, a silent one if standard output is not for people."""
    if not stdout_is_for_people:
        return Silent()
    if not (sys.stdout.isatty() or os.environ.get("FORCE_COLOR")):
        return PlainConsole()
    from rich import console as rich

    return rich.Console(highlight=False, markup=False, emoji=False)


def print_table(console: Console, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table with columns as wide as their longest cell; on a narrow terminal, cells are folded."""
    if isinstance(console, PlainConsole):
        lines = [list(columns), *map(list, rows)] if any(columns) else [list(row) for row in rows]
        widths = [max(len(line[at]) for line in lines) for at in range(len(columns))] if lines else []
        for line in lines:
            console.print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())
        return
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="bold", show_header=any(columns))
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    console.print(table)
