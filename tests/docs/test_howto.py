"""docs/howto: each page works as it stands, beside the files of the first two steps of the tutorial."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.page import ROOT, follow, write_files

OF_OTHERS = {"docs/howto/speak_over_can.md",        # need extras: test_can_stacks_page.py, test_cortex_m_page.py
             "docs/howto/computing_takes_time.md"}
SLOW = {"docs/howto/campaign.md", "docs/howto/device_in_the_loop.md", "docs/howto/fault_experiment.md",
        "docs/howto/find_the_worst.md", "docs/howto/late_messages.md", "docs/howto/use_in_a_notebook.md",
        "docs/howto/use_in_pytest.md"}
PAGES = [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name
         for page in sorted((ROOT / "docs" / "howto").glob("*.md"))
         if (name := str(page.relative_to(ROOT))) not in OF_OTHERS]


@pytest.mark.parametrize("page", PAGES)
def test_a_page_works_as_it_stands(page: str, tmp_path: Path) -> None:
    write_files("docs/tutorial/1_two_beacons.md", tmp_path)
    write_files("docs/tutorial/2_a_cart.md", tmp_path)

    follow(page, tmp_path)
