"""The tables of docs/reproduction.md, read by the tests that compute their rows."""

from __future__ import annotations

from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "reproduction.md"


def documented(chapter: str) -> dict[str, str]:
    """Return the third cell ("ours") of each row of a chapter, as "Chapter 2", by its first cell, the row's name."""
    text = PAGE.read_text(encoding="utf-8").split(f"## {chapter}")[1].split("\n## ")[0]
    cells = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in text.splitlines()
             if line.startswith("| `")]
    return {row[0].strip("`"): row[2] for row in cells}
