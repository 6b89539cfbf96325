"""Every command on the page of answers names what is there."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from experiments.scenario import find

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "answers.md").read_text()
ROWS = [line.strip("| ").split(" | ") for line in PAGE.splitlines() if line.startswith("| ") and "question" not in line]
COMMANDS = sorted({shlex.join(shlex.split(command)) for row in ROWS for command in re.findall(r"`([^`]+)`", row[-1])})


def test_only_what_is_not_answered_has_no_command() -> None:
    without = [row for row in ROWS if "`" not in row[-1]]

    assert len(COMMANDS) > 20
    assert all(row[1].strip(" |").startswith(("Not answered", "Not proved")) for row in without), without


@pytest.mark.parametrize("command", COMMANDS)
def test_its_scenario_or_tests_exist(command: str) -> None:
    words = shlex.split(command)
    if words[0] == "pytest":
        names = (ROOT / words[1]).read_text() + (ROOT / "docs" / "reproduction.md").read_text()
        words += ["-k", ""] if "-k" not in words else []
        keys = re.split(r"\s+or\s+|\s+and\s+", words[words.index("-k") + 1])
        assert [key for key in keys if key not in names] == []
    elif words[0] == "python":
        assert (ROOT / (words[2].replace(".", "/") + ".py")).is_file()
    elif words[1] in ("run", "sweep", "check"):
        assert find(words[2]).is_file()
    else:
        assert words[:2] == ["marconet", "table"]
