"""docs/expectations_in_time.md: its example runs as it says, and no word of the language is missing from it."""

from __future__ import annotations

from pathlib import Path

from experiments.scenario.cost_kinds import COSTS
from experiments.scenario.formula.parse import WORDS
from experiments.scenario.shape import shape_of
from tests.docs.page import ROOT, follow

PAGE = "docs/expectations_in_time.md"


def test_the_page_works_as_it_stands(tmp_path: Path) -> None:
    follow(PAGE, tmp_path)


def test_the_page_has_every_word_and_every_key() -> None:
    text = (ROOT / PAGE).read_text(encoding="utf-8")

    missing = [word for word in (*WORDS, *COSTS) if word not in text]
    missing += [key for cls in COSTS.values() for key in shape_of(cls).field_of if f"`{key}`" not in text]
    assert missing == []
