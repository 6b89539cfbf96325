"""docs/command_line.md: its examples run as they stand."""

from __future__ import annotations

import os
import re
import subprocess
import sysconfig
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs/command_line.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.slow
def test_every_example_of_the_page_runs(tmp_path):
    environment = {**os.environ, "PATH": f"{sysconfig.get_path('scripts')}:{os.environ['PATH']}"}

    done = subprocess.run(["bash", "-euo", "pipefail", "-c", "\n".join(EXAMPLES)], cwd=tmp_path, env=environment,
                          capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "blinker", "captures", "certificates", "marconet.schema.json", "runs"]


def test_every_command_has_a_place_on_the_page():
    from marconet.command_line import app

    assert all(re.search(rf"^## .*\b{name}\b", PAGE, re.MULTILINE) for name in app.commands)
