"""The page docs/models/impairments.md: each kind has an example that works."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from netem.core.link_selector import parse
from netem.core.random_streams import stream
from netem.core.transit import Transit
from netem.impairments.construct import PASSED_IN
from netem.impairments.table import IMPAIRMENTS
from netem.impairments.window import Window

PAGE = Path(__file__).parents[3] / "docs" / "models" / "impairments.md"
TABLES = [tomllib.loads(text)["impairments"][0] for text in re.findall(r"```toml\n(.*?)```", PAGE.read_text(), re.S)]
NODES = {"radio": ["leader", "follower", "base", "rover"], "serial": ["autopilot", "companion"]}
NS_PER = {"s": 1e9, "ms": 1e6, "us": 1e3}


def in_nanoseconds(key, value):
    stem, _, unit = key.rpartition("_")
    if unit not in NS_PER:
        return key, value
    per = NS_PER[unit]
    return f"{stem}_ns", [round(v * per) for v in value] if isinstance(value, list) else round(value * per)


def test_every_kind_has_an_example_and_its_parameters_are_on_the_page():
    assert [table["kind"] for table in TABLES] == re.findall(r"^## (\w+)$", PAGE.read_text(), re.M)[:len(TABLES)]
    assert {table["kind"] for table in TABLES} == set(IMPAIRMENTS)
    for kind in IMPAIRMENTS.values():
        for key in [field.name for field in fields(kind) if field.init and field.name not in PASSED_IN]:
            assert re.search(rf"^\| `{key.removesuffix('_ns')}(_ms)?` \|", PAGE.read_text(), re.M), key


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table["kind"])
def test_the_example_builds_and_carries_a_frame(table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("trace.csv").write_text("delay_ms,lost\n12.5,0\n")
    settings = dict(in_nanoseconds(key, value) for key, value in table.items())
    links, kind = parse(settings.pop("on")).resolve(NODES), IMPAIRMENTS[settings.pop("kind")]
    during = settings.pop("during_ns", [0, 1])
    rng = {"rng": stream(7, "docs")} if "rng" in kind.__dataclass_fields__ else {}

    impairment = Window(kind(**settings, **rng), during)

    assert links
    assert all(copy.arrival_ns >= 0 for copy in impairment.carry(Transit(0, 0, 0, b"frame")))
