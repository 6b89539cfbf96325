"""Key expressions without the library, beside the library's."""

from __future__ import annotations

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from netem.wire.zenoh_keys import includes, problem_of

CHUNKS = st.sampled_from(["a", "b", "ab", "*", "**", "a$*", "$*b", "a$*b", "$*a$*", "@v", "@v$*", "$*", "a*", "", "a?",
                          "a$*$*", "$", "@"])
KEYS = st.lists(CHUNKS, min_size=1, max_size=4).map("/".join)


def valid(key: str) -> bool:
    try:
        return str(zenoh.KeyExpr(key)) == key
    except zenoh.ZError:
        return False


@given(KEYS)
def test_a_key_expression_is_valid_where_the_library_takes_it(key: str) -> None:
    assert (problem_of(key) == "") == valid(key), (key, problem_of(key))


@given(KEYS.filter(valid), KEYS.filter(valid))
def test_one_includes_the_other_where_the_library_says_so(wide: str, narrow: str) -> None:
    assert includes(wide, narrow) == zenoh.KeyExpr(wide).includes(narrow)


@pytest.mark.parametrize(("key", "problem"), [
    ("a//b", "empty chunks are forbidden, as well as leading and trailing slashes"),
    ("a/**/*", "**/* is written */**"),
    ("a#b", "'a#b' holds one of # ?"),
])
def test_what_is_wrong_is_said(key: str, problem: str) -> None:
    assert problem_of(key) == problem
