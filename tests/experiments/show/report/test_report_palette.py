"""Colours can be seen: contrast as WCAG 2.1 defines it, on light and on dark."""

from __future__ import annotations

import re
from importlib.resources import files

import pytest

from experiments.show.report.palette import CARD, CURVES, FATES, HIGH, LOW, MIDDLE, SWITCHED, VIOLATED
from netem.core.fate import Fate

GRAPHICS = 3.0          # WCAG 2.1, 1.4.11
TEXT = 4.5              # 1.4.3
DRAWN = [*CURVES, VIOLATED, SWITCHED, LOW, MIDDLE, HIGH, *FATES.values()]
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


def test_every_fate_has_a_colour() -> None:
    assert set(FATES) == set(Fate)
