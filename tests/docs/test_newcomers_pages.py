"""docs/architecture.md, concepts.md and vocabulary.md: what they name is there, and the summary shown is a run's."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from firmware_sim import old_names
from tests.docs.page import ROOT, follow, write_files

PAGES = ("docs/architecture.md", "docs/concepts.md", "docs/vocabulary.md")
FILE = re.compile(r"`(\w+/[\w./]*\.(?:py|toml))`")
PLACES = re.compile(r"`([\w/]+\.py)`((?: `[\w.]+`(?:, )?)+)")


def names_in(file: str) -> set[str]:
    """`function`, `Class` and `Class.method` of a module."""
    names: set[str] = set()
    for node in ast.parse((ROOT / file).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        if isinstance(node, ast.ClassDef):
            names |= {f"{node.name}.{each.name}" for each in node.body if isinstance(each, ast.FunctionDef)}
    return names


@pytest.mark.parametrize("page", PAGES)
def test_every_file_and_every_name_of_a_page_is_there(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")

    assert [file for file in FILE.findall(text) if not (ROOT / file).is_file()] == []
    assert [(file, name) for file, names in PLACES.findall(text) for name in re.findall(r"`([\w.]+)`", names)
            if name not in names_in(file)] == []


def test_the_summary_of_the_concepts_is_that_of_the_tutorials_run(tmp_path: Path) -> None:
    for step in ("1_two_beacons", "2_a_cart", "3_a_lossy_link"):
        write_files(f"docs/tutorial/{step}.md", tmp_path)

    follow("docs/concepts.md", tmp_path)


def test_the_base_of_the_page_on_programs_is_answered(tmp_path: Path) -> None:
    follow("docs/program.md", tmp_path)


def test_every_method_of_a_board_is_on_the_page_on_programs() -> None:
    text = (ROOT / "docs/program.md").read_text(encoding="utf-8")
    for_others = {"before_counters", "clock_reading", "end_run", "hold_time_outs", "keep_promises", "present_ns",
                  "slowness", "take_faults", "when_slowed", *old_names.BOARD}

    (board,) = (node for node in ast.parse((ROOT / "firmware_sim/board.py").read_text(encoding="utf-8")).body
                if isinstance(node, ast.ClassDef) and node.name == "Board")
    names = [node.name for node in board.body if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")]
    assert "promise_firm" in names
    assert [name for name in names if name not in for_others and not re.search(rf"`{name}\b", text)] == []


def test_the_vocabulary_is_in_order_and_has_each_word_once() -> None:
    rows = re.findall(r"^\| ([^|]+) \|", (ROOT / "docs/vocabulary.md").read_text(encoding="utf-8"), re.MULTILINE)[1:]

    assert rows == sorted(set(rows), key=str.lower)
