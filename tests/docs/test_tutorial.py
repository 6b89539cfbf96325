"""docs/tutorial: a reader who types only what its four pages say gets the output that they show."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.page import ROOT, blocks, follow, write_files

STEPS = sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs" / "tutorial").glob("*.md"))


@pytest.mark.parametrize("page", [*STEPS[:2], *(pytest.param(page, marks=pytest.mark.slow) for page in STEPS[2:])])
def test_a_step_of_the_tutorial_works_as_it_stands(page: str, tmp_path: Path) -> None:
    for earlier in STEPS[:STEPS.index(page)]:
        write_files(earlier, tmp_path)

    follow(page, tmp_path)


def test_the_job_of_the_last_step_types_what_its_page_has_shown() -> None:
    jobs, = (block for block in blocks(STEPS[-1]) if block.language == "yaml")
    shown = [block.text.strip() for block in blocks(STEPS[-1]) if block.language == "sh"]

    install, command = re.findall(r"^ +- run: (.+)$", jobs.text, re.MULTILINE)

    assert install.startswith("pip install pytest ")
    assert command == f"{shown[-1]} --junit-xml results.xml"


def test_the_readme_shows_the_program_and_the_scenario_of_the_first_step() -> None:
    first = [block for block in blocks(STEPS[0]) if block.file]

    assert [block for block in blocks("README.md") if block.file] == first
