"""Signals worked out after the run: which instants, which arrays, and what is said when it cannot be done."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from experiments.judge.derived_signals import derive
from netem.records.signal_table import SignalTable

MODULE = """
import numpy as np

def difference(a, b, factor=1.0):
    return factor * (a - b)

def both(a, b):
    return a + b, a * b

def short(a, b):
    return a[1:]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "own_functions.py").write_text(MODULE)
    return tmp_path


def table(node: str, first_ms: int, values: list[float]) -> SignalTable:
    instants = (np.arange(len(values)) + first_ms) * 1_000_000
    return SignalTable(node, ("y",), ("m",), instants, np.array([values]).T)


RECORDED = {"r1": table("r1", 0, [1.0, 2.0, 3.0]), "r2": table("r2", 1, [10.0, 20.0, 30.0])}


def declared(function: str, signals: dict[str, str], **parameters: float) -> dict[str, object]:
    return {"function": f"own_functions:{function}", "of": ["r1.y", "r2.y"], "signals": signals,
            "parameters": parameters}


def test_only_instants_that_all_have_count(folder):
    missing: list[str] = []
    error = derive({"error": declared("difference", {"e": "m"}, factor=2.0)}, RECORDED, folder, missing)["error"]

    assert missing == []
    assert error.time_ns.tolist() == [1_000_000, 2_000_000]
    assert error.column("e").tolist() == [2 * (2.0 - 10.0), 2 * (3.0 - 20.0)]
    assert (error.node, error.units) == ("error", ("m",))


def test_several_signals_and_one_after_the_other(folder):
    asked = {"two": declared("both", {"sum": "m", "product": "m2"}),
             "again": {"function": "own_functions:difference", "of": ["two.sum", "two.product"], "signals": {"d": "1"},
                       "parameters": {}}}
    tables = derive(asked, RECORDED, folder, [])

    assert tables["two"].column("product").tolist() == [20.0, 60.0]
    assert tables["again"].column("d").tolist() == [12.0 - 20.0, 23.0 - 60.0]
    assert tables["r1"] is RECORDED["r1"]


@pytest.mark.parametrize(("change", "complaint"), [
    ({"of": ["r1.z", "r2.y"]}, "r1.z: r1 has no signal 'z'; it has y"),
    ({"of": ["r3.y", "r2.y"]}, "r3.y: no signals of r3 are on record"),
    ({"function": "own_functions:short"}, "expected one of shape (2,) for each"),
    ({"function": "own_functions:no"}, "there is no function 'no'"),
    ({"parameters": {"what": 1}}, "TypeError"),
])
def test_what_cannot_be_worked_out_is_named_and_the_rest_is_there(folder, change, complaint):
    missing: list[str] = []
    tables = derive({"error": declared("difference", {"e": "m"}) | change}, RECORDED, folder, missing)

    assert set(tables) == {"r1", "r2"}
    assert len(missing) == 1
    assert missing[0].startswith("derived.error: ")
    assert complaint in missing[0]
