"""The picture is well-formed SVG and draws each output once."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.show.report.picture import LEFT, WIDTH, ticks, write_picture

SVG = "{http://www.w3.org/2000/svg}"


def test_the_picture_has_one_line_per_output_and_one_dot_per_switch(whole_run: Path) -> None:
    root = ElementTree.parse(write_picture(whole_run)).getroot()

    assert len(root.findall(f"{SVG}polyline")) == 5
    assert len(root.findall(f"{SVG}circle")) == 25 + 1      # one in the legend
    assert "robot time [s]" in "".join(root.itertext())


def test_the_last_sample_stands_at_its_time(whole_run: Path) -> None:
    root = ElementTree.parse(write_picture(whole_run)).getroot()

    for curve in root.findall(f"{SVG}polyline"):
        last_x = float(curve.attrib["points"].split()[-1].split(",")[0])
        assert last_x == pytest.approx(LEFT + 12.99 / 13 * (WIDTH - LEFT - 16), abs=0.005)


def test_a_run_without_outputs_has_a_picture_that_says_so(tmp_path: Path) -> None:
    root = ElementTree.parse(write_picture(tmp_path)).getroot()

    assert "no outputs recorded" in "".join(root.itertext())


@given(st.floats(-1, 1), st.floats(1e-6, 1e3), st.integers(-15, 9), st.integers(2, 20))
def test_ticks_are_round_and_enclose_the_range(place: float, spread: float, power: int, most: int) -> None:
    low = place * 10.0**power
    high = low + spread * 10.0**power

    found = ticks(low, high, most)

    step = found[1] - found[0]
    rounding = 1e-8 * step + 8 * math.ulp(max(abs(low), abs(high)))
    assert found[0] <= low + rounding
    assert found[-1] >= high - rounding
    assert step > 0
    assert 2 <= len(found) <= most + 3


@pytest.mark.parametrize("value", [0.0, 1e-13, -7.0, 1e20])
def test_a_constant_has_ticks_around_it(value: float) -> None:
    found = ticks(value, value, 6)

    assert found[0] <= value <= found[-1]
    assert found[-1] > found[0]
