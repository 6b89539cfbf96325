"""docs/python.md: its examples run on README's scenarios, and what it names is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import marconet
from tests.docs.page import ROOT, write_files

PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write_files("README.md", tmp_path)
    return tmp_path


def test_the_first_example_runs(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    exec(EXAMPLES[0], {})

    assert capsys.readouterr().out.startswith("False count.r1.heard is ")


def test_every_name_is_there() -> None:
    table = PAGE[PAGE.index("| of a `Run`"):PAGE.index("Data frames are")]
    names = {name for cell in re.findall(r"^\| (`[^|]*)\|", table, re.MULTILINE)
             for name in re.findall(r"`(\w+)", cell)}

    assert names == {name for name in vars(marconet.Run) if not name.startswith("_")} | {"folder"}
    assert {f"marconet.{name}" for name in marconet.__all__} - {"marconet.Run"} <= set(
        re.findall(r"marconet\.\w+", PAGE))
