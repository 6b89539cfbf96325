"""The "ours" column of docs/reproduction.md, Chapter 5, and the bands of `marconet table 5.x`, computed row by row.

`pytest -s tests/agents/optimal_triggering/test_reproduction.py -k f2-value` prints the row "f2-value".
"""

import pytest

from agents.optimal_triggering.rollouts import Mean
from experiments.show.tables import Measured
from experiments.show.tables.chapter_5 import TABLES
from tests.agents.reproduction_page import documented

ENTRIES = {entry.name: (number, entry) for number, table in TABLES.items() for entry in table.entries}
LONG = ("f1-independent", "f1-rollout", "f1-stop", "f3")        # seconds each: rollouts, online iteration


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) if name.startswith(LONG) else name
                                  for name in ENTRIES])
def test_the_page_says_what_the_code_gives_and_it_is_what_it_has_to_be(name):
    number, entry = ENTRIES[name]
    found = entry.measure(TABLES[number].runs)
    value = found.mean if isinstance(found, Mean) else found
    print(f"{name}: {value:.{entry.digits}f} {entry.row.unit}")

    assert documented("Chapter 5")[name] == f"{value:.{entry.digits}f}"
    assert Measured(entry.row, value, None, 1).met is not False


def test_the_page_has_no_row_that_is_not_computed():
    assert set(documented("Chapter 5")) == set(ENTRIES)
