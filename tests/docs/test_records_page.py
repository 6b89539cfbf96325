"""docs/records.md says of each fate, and of each file of a run folder, what the code says."""

from __future__ import annotations

import re
from pathlib import Path

from experiments.show.report.records_list import KINDS
from netem.core.fate import Fate

PAGE = (Path(__file__).parents[2] / "docs" / "records.md").read_text(encoding="utf-8")


def table(heading: str) -> dict[str, list[str]]:
    """The rows under a table's first heading cell: first cell without its backticks -> the other cells."""
    rows = re.search(rf"^\| {heading} \|.*\n\|[-|]+\n((?:\|.*\n)+)", PAGE, re.MULTILINE)
    assert rows is not None, f"docs/records.md has no table that begins with {heading!r}"
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in rows[1].splitlines()]
    return {first.strip("`"): rest for first, *rest in cells}


def test_the_page_gives_each_fate_the_meaning_that_the_report_shows() -> None:
    told = {fate: meaning for fate, (meaning,) in table("fate").items()}

    assert told == {fate.value: fate.meaning for fate in Fate}


def test_the_page_names_every_file_that_the_report_links() -> None:
    files = [kind.pattern for kind in KINDS if "*" not in kind.pattern]

    assert [name for name in files if f"`{name}`" not in PAGE] == []
