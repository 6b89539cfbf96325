"""docs/tutorial: whoever types what its four pages say, and nothing else, gets what they show."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from tests.docs.page import ROOT, blocks, follow, type_in, write_files

STEPS = sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs" / "tutorial").glob("*.md"))


@pytest.mark.parametrize("page", STEPS)
def test_a_step_of_the_tutorial_works_as_it_stands(page: str, tmp_path: Path) -> None:
    for earlier in STEPS[:STEPS.index(page)]:
        write_files(earlier, tmp_path)

    follow(page, tmp_path)


def test_the_job_of_the_last_step_runs_what_the_page_has_shown(tmp_path: Path) -> None:
    for page in STEPS:
        write_files(page, tmp_path)
    job, = yaml.safe_load((tmp_path / ".github/workflows/robots.yml").read_text())["jobs"].values()

    *_, install, command = [step["run"] for step in job["steps"] if "run" in step]
    printed = type_in(tmp_path, command)

    assert install.startswith("pip install pytest ")
    assert "9 passed" in printed
    assert (tmp_path / "results.xml").exists()


def test_the_readme_shows_the_program_and_the_scenario_of_the_first_step() -> None:
    first = [block for block in blocks(STEPS[0]) if block.file]

    assert [block for block in blocks("README.md") if block.file] == first
