"""Does what a page of docs/ tells its reader: writes its files, types its commands, compares what it shows.

- A block whose first line names a file (`# beacon.py`, `/* cart/model.c`) is written there; `, at its end`: appended.
- A block of TOML that names none changes lines of the file written last: each replaces the line that begins like it.
- Each line of an `sh` block is typed, but for `pip install`; its exit code is 0, or as `# exit code 1` in it says.
- Blocks of Python that name no file are the cells of one notebook, executed after all else.
- Each line of a `text` block is in the output of the `sh` block before it, whatever the spaces.
"""

from __future__ import annotations

import os
import re
import subprocess
import sysconfig
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
NAMED = re.compile(r"(?:#|/\*) (?P<name>[\w./]+\.(?:toml|py|c|yml|ini))(?P<appended>, at its end)?")


class Block(NamedTuple):
    language: str
    text: str

    @property
    def file(self) -> re.Match[str] | None:
        return NAMED.match(self.text)


def blocks(page: str) -> list[Block]:
    """The fenced blocks of a page, by its path from the root."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return [Block(*found) for found in re.findall(r"^```(\w+)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)]


def write_files(page: str, folder: Path) -> list[Path]:
    """Write and change the files of a page, without typing its commands; the files that it names."""
    written: list[Path] = []
    for block in blocks(page):
        _write(block, folder, written)
    return written


def follow(page: str, folder: Path) -> None:
    """Do all that the page says, in its order, in `folder`."""
    written: list[Path] = []
    output = ""
    for block in blocks(page):
        if block.language == "sh":
            output = "".join(type_in(folder, line) for line in block.text.splitlines())
        elif block.language == "text":
            told = {_plain(line) for line in output.splitlines()}
            missing = [line for line in block.text.splitlines() if not any(_plain(line) in each for each in told)]
            assert not missing, f"{page}: {missing} not in\n{output}"
        else:
            _write(block, folder, written)
    cells = [block.text for block in blocks(page) if block.language == "python" and not block.file]
    if cells:
        (folder / "cells.py").write_text("\n".join(cells))
        type_in(folder, "python cells.py")


def type_in(folder: Path, line: str) -> str:
    """Type a line into a shell; what it prints. AssertionError if its exit code is not the one that it tells."""
    if not line.strip() or line.startswith("pip install "):
        return ""
    environment = {**os.environ, "PATH": f"{sysconfig.get_path('scripts')}:{os.environ['PATH']}",
                   "MARCONET_CACHE": str(folder / "cache")}
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", line], cwd=folder, env=environment, capture_output=True,
                          text=True, timeout=300)
    expected = re.search(r"# exit code (\d+)", line)
    assert done.returncode == (int(expected[1]) if expected else 0), f"$ {line}\n{done.stdout}\n{done.stderr}"
    return done.stdout + done.stderr


def _write(block: Block, folder: Path, written: list[Path]) -> None:
    if block.file:
        path = folder / block.file["name"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text((path.read_text() + "\n" if block.file["appended"] else "") + block.text)
        written.append(path)
    elif block.language == "toml":
        path = written[-1] if written else folder / "two_carts.toml"
        for line in block.text.splitlines():
            start = re.match(r"\D*", line)
            assert start
            text, count = re.subn(rf"^{re.escape(start[0])}.*$", line, path.read_text(), flags=re.MULTILINE)
            assert count == 1, f"{path.name}: {count} lines begin with {start[0]!r}"
            path.write_text(text)


def _plain(line: str) -> str:
    return " ".join(line.split())
