"""The page on Zenoh programs: what it tells its reader to do works, and it names all that the room refuses."""

from __future__ import annotations

from pathlib import Path

from firmware_sim.zenoh_programs.replaced import FUNCTIONS
from tests.docs.page import ROOT, follow

PAGE = "docs/zenoh_programs.md"


def test_the_example_of_the_page_does_what_it_shows(tmp_path: Path) -> None:
    follow(PAGE, tmp_path)


def test_every_function_that_is_refused_is_named() -> None:
    text = (ROOT / PAGE).read_text(encoding="utf-8").partition("## What is not there")[2]

    refused = [name for _, name, virtual in FUNCTIONS if "_refused" in repr(virtual)]
    assert len(refused) == 4
    assert [name for name in refused if name not in text] == []
