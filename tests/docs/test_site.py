"""`make docs`: the site builds without a warning, its links lead somewhere, and a link that does not is told."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from html import unescape
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote

import pytest

from firmware_sim.board import Board
from tests.browser import browser, needs_browser
from tests.docs.page import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.skipif(find_spec("zensical") is None or find_spec("griffe") is None,
                                                   reason="needs the generator: pip install -e '.[docs]'")]


def build(root: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(root / "docs" / "build_site.py"), str(folder)], capture_output=True,
                          text=True, timeout=600)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site") / "site"
    done = build(ROOT, folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "No issues found" in done.stdout + done.stderr
    return folder


def test_every_page_of_the_sources_is_in_the_site(site: Path) -> None:
    pages = [page.relative_to(ROOT / "docs").with_suffix(".html") for page in (ROOT / "docs").rglob("*.md")]

    assert [page for page in pages if page.name != "README.html" and not (site / page).is_file()] == []
    assert all((site / page).is_file() for page in ("index.html", "about.html", "changelog.html"))


def test_every_link_between_pages_of_the_site_leads_to_a_page_and_to_an_anchor_that_are_there(site: Path) -> None:
    texts = {page: page.read_text(encoding="utf-8") for page in site.rglob("*.html") if page.name != "404.html"}
    anchors = {page: {unescape(anchor) for anchor in re.findall(r'\bid="([^"]+)"', text)}
               for page, text in texts.items()}

    missing = []
    for page, text in texts.items():
        for link in re.findall(r'<a [^>]*href="([^"]+)"', text):
            target, _, anchor = unquote(unescape(link)).partition("#")
            if re.match(r"\w+:", target):
                continue
            to = (page.parent / target).resolve() if target else page
            if not to.exists() or (anchor and to in anchors and anchor not in anchors[to]):
                missing.append(f"{page.relative_to(site)}: {link}")
    assert missing == []


def test_the_reference_has_the_docstrings_and_no_private_names(site: Path) -> None:
    text = (site / "reference" / "firmware_sim.html").read_text(encoding="utf-8")

    begins = str(Board.sense.__doc__).partition(":")[0]
    assert 'id="firmware_sim.board.Board.sense"' in text
    assert len(begins) > 20
    assert begins in unescape(text)
    assert 'id="firmware_sim.board.Board._' not in text


def test_a_link_that_leads_nowhere_fails_the_build(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "docs", tmp_path / "docs")
    for name in ("README.md", "CHANGELOG.md"):
        shutil.copy(ROOT / name, tmp_path)
    with (tmp_path / "docs" / "concepts.md").open("a") as page:
        page.write("\n[nowhere](nowhere.md)\n")

    done = build(tmp_path, tmp_path / "site")

    assert done.returncode == 1
    assert "page does not exist" in done.stdout + done.stderr


@needs_browser
def test_a_page_draws_from_the_disk_without_an_error(site: Path, tmp_path: Path) -> None:
    with browser(tmp_path / "profile") as opened:
        opened.show(site / "tutorial" / "1_two_beacons.html")

        assert opened.run("document.querySelector('h1').innerText").startswith("1. Two beacons")
        without_search = [error for error in opened.errors if "FILE_NOT_FOUND" not in error]      # needs a server
        assert without_search == []
