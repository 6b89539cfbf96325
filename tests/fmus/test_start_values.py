"""Start values of every type of FMI 2.0 and 3.0, on FMUs that keep what they are given."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from fmus.plant import Plant, PlantError
from fmus.start_values import RANGES, start_values
from tests.fmus.foreign_fmus import types_fmi2, types_fmi3

WIDTHS = {"i8": "Int8", "u8": "UInt8", "i16": "Int16", "u16": "UInt16", "i32": "Int32", "u32": "UInt32",
          "i64": "Int64", "u64": "UInt64"}


@pytest.fixture(scope="module")
def types3(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> PlantDescription:
    return describe(types_fmi3(tmp_path_factory.mktemp("types3")), cache)


@pytest.fixture(scope="module")
def types2(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> PlantDescription:
    return describe(types_fmi2(tmp_path_factory.mktemp("types2")), cache)


def test_every_type_of_fmi2_keeps_its_start_value(types2: PlantDescription) -> None:
    start = {"real": 2, "integer": -2**31, "mode": "slow", "flag": True, "text": "näme"}

    with Plant(types2, "t", start) as plant:
        assert [plant.get(name) for name in start] == [2.0, -2**31, 2, True, "näme"]


def test_every_type_of_fmi3_keeps_its_start_value(types3: PlantDescription) -> None:
    start = {"f32": 0.5, "f64": 1, "flag": True, "text": "näme", "blob": "00 ff10", "mode": "far"}

    with Plant(types3, "t", start) as plant:
        assert [plant.get(name) for name in start] == [0.5, 1.0, True, "näme", b"\x00\xff\x10", -7_000_000_000]


@pytest.mark.parametrize("name", WIDTHS)
def test_an_integer_of_any_width_takes_its_whole_range_and_nothing_beyond(name: str, types3: PlantDescription) -> None:
    low, high = RANGES[WIDTHS[name]]
    high = 200 if name == "u8" else high        # its description says max="200"

    for value in (low, high):
        with Plant(types3, "t", {name: value}) as plant:
            assert plant.get(name) == value
    for value in (low - 1, high + 1):
        with pytest.raises(PlantError, match=rf"t: start: {name}={value}: expected "):
            Plant(types3, "t", {name: value})


def test_an_enumeration_goes_by_number_or_by_the_name_of_an_item(types2: PlantDescription) -> None:
    for value in (2, "slow"):
        with Plant(types2, "t", {"mode": value}) as plant:
            assert plant.get("mode") == 2
    for value in (3, "fast", 1.0, True):
        with pytest.raises(PlantError, match=r"expected the number or name of an item: off \(1\), slow \(2\)$"):
            Plant(types2, "t", {"mode": value})


def test_an_array_takes_one_value_for_all_or_a_nested_list(types3: PlantDescription) -> None:
    with Plant(types3, "t", {"matrix": 2.5, "vector": [1, 2, -3], "texts": "all"}) as plant:
        assert plant.get("matrix") == (2.5,) * 6
        assert plant.get("vector") == (1, 2, -3)
        assert plant.get("texts") == ("all",) * 3
    with Plant(types3, "t", {"matrix": [[1, 2, 3], [4, 5, 6]]}) as plant:
        assert plant.get("matrix") == (1, 2, 3, 4, 5, 6)
        assert plant.get("sum") == 21


def test_a_structural_parameter_changes_the_sizes_of_arrays(types3: PlantDescription) -> None:
    with Plant(types3, "t", {"matrix": [[1], [2], [3]], "vector": 7, "columns": 1, "rows": 3}) as plant:
        assert (plant.get("rows"), plant.get("columns")) == (3, 1)
        assert plant.get("matrix") == (1, 2, 3)
        assert plant.get("vector") == (7,)


@pytest.mark.parametrize(("start", "rule"), [
    ({"matrix": [[1, 2], [3, 4]]}, "expected a number for all elements, or nested lists of 2 x 3"),
    ({"matrix": [[1, 2, 3], [4, 5, 6]], "rows": 1}, "expected a number for all elements, or nested lists of 1 x 3"),
    ({"matrix": [1, 2, 3, 4, 5, 6]}, "expected a number for all elements, or nested lists of 2 x 3"),
    ({"vector": [1, 2.5, 3]}, "expected a whole number for all elements, or a list of 3"),
    ({"rows": 0}, "expected at least 1: it is the size of an array"),
    ({"rows": 2**40}, "makes matrix an array of 3298534883328 elements: at most 1000000 are held"),
    ({"columns": 9}, "expected at most 8"),
    ({"f32": 1e39}, "expected a number within the range of 32-bit floating point, +-3.4e38"),
    ({"f64": 1.5}, "expected 0 to 1"),
    ({"f64": "1"}, "expected a number"),
    ({"flag": 1}, "expected true or false"),
    ({"text": 3}, "expected text in quotes"),
    ({"text": "a\0b"}, "expected text without the character U+0000, which ends a text of FMI"),
    ({"blob": "0"}, 'expected hexadecimal digits in quotes, two a byte: "00ff"'),
    ({"blob": "00" * 9}, "9 bytes: expected at most 8"),
    ({"sum": 1}, "is an output: it has no start value to set"),
])
def test_what_does_not_fit_is_refused_with_the_rule(start: dict[str, Any], rule: str, types3: PlantDescription) -> None:
    found = start_values(types3.variables, start)

    assert list(found.complaints.values()) == [rule]
    with pytest.raises(PlantError) as caught:
        Plant(types3, "t", start)
    assert str(caught.value).endswith(f": {rule}")


VALUES = st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary(max_size=3),
                      lambda inner: st.lists(inner, max_size=4), max_leaves=8)


@given(data=st.data())
def test_what_is_accepted_can_be_set_and_is_kept(data: st.DataObject, types3: PlantDescription) -> None:
    """`check` and the plant agree: what brings no complaint is taken, whatever it is."""
    names = data.draw(st.lists(st.sampled_from(sorted(set(types3.variables) - {"rows"})), unique=True, max_size=4))
    start = {name: data.draw(VALUES) for name in names}

    found = start_values(types3.variables, start)

    fitting = {name: value for name, value in start.items() if name not in found.complaints}
    with Plant(types3, "t", fitting) as plant:
        for name, elements in start_values(types3.variables, fitting).values.items():
            kept = plant.get(name)
            given = elements if isinstance(kept, tuple) else elements[0]
            if isinstance(kept, str):
                assert kept == given.decode()[:255] or len(given) > 255
            elif types3.variables[name].type not in ("Float32", "String"):
                assert kept == (tuple(given) if isinstance(kept, tuple) else given)
