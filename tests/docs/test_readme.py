"""README.md: what it tells a newcomer to write and to type works, in a folder that has nothing else in it."""

from __future__ import annotations

import os
import re
import subprocess
import sysconfig
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
OWN = README[README.index("## Your own scenario"):README.index("## What a run leaves")]
FILE = re.compile(r"(?:#|/\*) (?P<name>[\w/]+\.(?:toml|py|c))(?P<appended>, at its end)?")


class Block(NamedTuple):
    language: str
    text: str


BLOCKS = [Block(*found) for found in re.findall(r"```(\w+)\n(.*?)```", OWN, re.DOTALL)]
WORDS_OF_MAKE = re.findall(r"^make ([\w-]+)", README, re.MULTILINE)


def write(folder: Path, block: Block) -> None:
    named = FILE.match(block.text)
    assert named, f"the first line names no file: {block.text.splitlines()[0]}"
    path = folder / named["name"]
    path.parent.mkdir(exist_ok=True)
    path.write_text((path.read_text() + "\n" if named["appended"] else "") + block.text)


def type_in(folder: Path, commands: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PATH": f"{sysconfig.get_path('scripts')}:{os.environ['PATH']}",
                   "MARCONET_CACHE": str(folder / "cache")}
    return subprocess.run(["bash", "-euo", "pipefail", "-c", commands], cwd=folder, env=environment,
                          capture_output=True, text=True, timeout=300)


def test_every_example_of_your_own_works_as_it_stands(tmp_path: Path) -> None:
    for block in BLOCKS:
        if block.language == "sh":
            done = type_in(tmp_path, block.text)
            assert done.returncode == 0, f"$ {block.text}\n{done.stdout}\n{done.stderr}"
        else:
            write(tmp_path, block)

    assert [block.language for block in BLOCKS].count("sh") == 3
    assert len(list((tmp_path / "runs").glob("*/report.html"))) == 3


def test_the_door_of_the_last_example_does_lose_frames(tmp_path: Path) -> None:
    for block in BLOCKS:
        if block.language != "sh":
            write(tmp_path, block)
    with (tmp_path / "two_carts.toml").open("a") as file:
        file.write("\n[expect.frames_lost_on_link]\nmin = 1300\nmax = 1600\n")      # of 2000, 0.8 * 0.9 = 1440, 8 sigma

    done = type_in(tmp_path, "marconet run two_carts.toml --host inline")

    assert done.returncode == 0, done.stdout + done.stderr


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
