"""README.md, and the links of all pages. The program and the scenario that it shows: test_tutorial.py."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
WORDS_OF_MAKE = re.findall(r"^make ([\w-]+)", README, re.MULTILINE)


@pytest.mark.parametrize("word", WORDS_OF_MAKE)
def test_make_knows_its_words(word: str) -> None:
    done = subprocess.run(["make", "-n", word], cwd=ROOT, capture_output=True, text=True)

    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", ["README.md", "CHANGELOG.md", "docs/README.md",
                                  *(str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md"))])
def test_links_between_pages_lead_somewhere(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")

    links = re.findall(r"\]\((?!https?:|#)([^)#]+)", re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL))

    assert [link for link in links if not ((ROOT / page).parent / link).exists()] == []


def test_every_page_is_listed() -> None:
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")

    pages = [str(page.relative_to(ROOT / "docs")) for page in (ROOT / "docs").rglob("*.md")]

    assert [page for page in pages if page != "README.md" and f"({page})" not in index] == []


def test_the_picture_is_small_enough_for_a_front_page() -> None:
    assert (ROOT / "docs" / "output_sync.svg").stat().st_size < 200_000
