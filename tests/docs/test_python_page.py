"""docs/python.md: its examples run on README's scenarios, and what it names is there."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import marconet

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
FILES = {name: f"# {name}{rest}" for _, name, rest in re.findall(
    r"```(toml|python)\n# (\w+\.(?:toml|py))(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)}
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        if "carts" not in name:
            (tmp_path / name).write_text(text)
    return tmp_path


def test_the_first_example_runs(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    exec(EXAMPLES[0], {})

    assert capsys.readouterr().out.startswith("False count.r1.heard is ")


def test_the_test_of_the_page_is_one(folder: Path) -> None:
    (folder / "test_page.py").write_text(EXAMPLES[1].replace("two_carts", "two_beacons"))

    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_page.py"], cwd=folder,
                          capture_output=True, text=True, check=False)

    assert "3 passed" in done.stdout, done.stdout


def test_every_name_is_there() -> None:
    table = PAGE[PAGE.index("| of a `Run`"):PAGE.index("Data frames are")]
    names = {name for cell in re.findall(r"^\| (`[^|]*)\|", table, re.MULTILINE)
             for name in re.findall(r"`(\w+)", cell)}

    assert names == {name for name in vars(marconet.Run) if not name.startswith("_")} | {"folder"}
    assert {f"marconet.{name}" for name in marconet.__all__} - {"marconet.Run"} <= set(
        re.findall(r"marconet\.\w+", PAGE))
