"""Colours can be seen: contrast as WCAG 2.1 defines it, on light and on dark."""

from __future__ import annotations

import re
from importlib.resources import files
from itertools import combinations

import numpy as np
import pytest

from experiments.show.report.palette import CARD, CURVES, FATES, HIGH, LOW, MARKS, MIDDLE, MODES, SWITCHED, VIOLATED
from netem.core.fate import Fate

GRAPHICS = 3.0          # WCAG 2.1, 1.4.11
TEXT = 4.5              # 1.4.3
DRAWN = [*CURVES, *MODES, *MARKS, VIOLATED, SWITCHED, LOW, MIDDLE, HIGH, *FATES.values()]
STYLE = (files("experiments.show.report") / "page" / "report.css").read_text("utf-8")
LIGHT, DARK = (dict(re.findall(r"--([\w-]+): (#\w{6});", block))
               for block in re.findall(r":root \{(.*?)\}", STYLE, re.DOTALL))


def luminance(colour: str) -> float:
    parts = [int(colour[k:k + 2], 16) / 255 for k in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    darker, lighter = sorted((luminance(one), luminance(other)))
    return (lighter + 0.05) / (darker + 0.05)


def test_black_on_white_has_the_largest_contrast() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)


@pytest.mark.parametrize("pair", DRAWN, ids=str)
def test_every_curve_and_bar_stands_out_from_the_card(pair) -> None:
    assert contrast(pair.light, CARD.light) >= GRAPHICS
    assert contrast(pair.dark, CARD.dark) >= GRAPHICS


@pytest.mark.parametrize("style", [LIGHT, DARK], ids=["light", "dark"])
@pytest.mark.parametrize(("words", "behind"), [
    ("ink", "page"), ("ink", "card"), ("soft", "page"), ("soft", "card"), ("accent", "card"), ("good", "card"),
    ("bad", "card"), ("good", "good-back"), ("bad", "bad-back"), ("ink", "warn-back"), ("ink", "bad-back")])
def test_every_word_can_be_read(style, words, behind) -> None:
    assert contrast(style[words], style[behind]) >= TEXT


def test_the_cards_of_the_page_are_those_that_colours_are_chosen_for() -> None:
    assert (LIGHT["card"], DARK["card"]) == CARD


# Machado, Oliveira, Fernandes 2009, severity 1: linear RGB as readers with a missing cone see it.
SEEN = {
    "all cones": np.eye(3),
    "protanopia": np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                            [-0.003882, -0.048116, 1.051998]]),
    "deuteranopia": np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                              [-0.011820, 0.042940, 0.968881]]),
    "tritanopia": np.array([[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                            [0.004733, 0.691367, 0.303900]]),
}
XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                [0.0193339, 0.1191920, 0.9503041]])
WHITE = np.array([0.95047, 1.0, 1.08883])
APART = 10.0        # CIE 1976; about 2.3 is just noticeable side by side


def lab(colour: str, seen: np.ndarray) -> np.ndarray:
    parts = np.array([int(colour[k:k + 2], 16) / 255 for k in (1, 3, 5)])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    x, y, z = np.cbrt(XYZ @ np.clip(seen @ linear, 0, 1) / WHITE)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("seen", SEEN.values(), ids=SEEN)
@pytest.mark.parametrize("side", [0, 1], ids=["light", "dark"])
def test_readers_with_a_missing_cone_tell_modes_apart(side: int, seen: np.ndarray) -> None:
    for one, other in combinations(MODES, 2):
        assert np.linalg.norm(lab(one[side], seen) - lab(other[side], seen)) > APART, (one[side], other[side])


def test_every_fate_has_a_colour() -> None:
    assert set(FATES) == set(Fate)
