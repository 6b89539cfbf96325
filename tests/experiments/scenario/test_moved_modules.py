"""The table of moved modules: the old name is gone, the new one is there."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from experiments.scenario.moved_modules import MOVED


@pytest.mark.parametrize("old", MOVED)
def test_a_moved_module_is_where_the_table_says(old: str) -> None:
    assert find_spec(MOVED[old]) is not None
    with pytest.raises(ModuleNotFoundError):
        __import__(old)
