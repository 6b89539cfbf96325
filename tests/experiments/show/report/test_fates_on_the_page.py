"""The page's script gets the fates as data: none is named in it."""

from __future__ import annotations

import re

import pytest

from experiments.show.report.build import PAGE
from netem.core.fate import Fate


@pytest.mark.parametrize("fate", Fate)
def test_the_script_repeats_no_fate(fate: Fate) -> None:
    script = "".join(path.read_text(encoding="utf-8") for path in (PAGE / "script").glob("*.js"))
    said = re.sub(r"//[^\n]*", "", script).replace("DATA.delivered", "")

    assert not re.search(rf"[\"'`.]{fate.value}\b", said)
