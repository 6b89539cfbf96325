"""A node may say anything of itself: it is named with what it said, and nothing of it reaches a record."""

from __future__ import annotations

import re

import pytest

from netem.wire.credible import credible
from netem.wire.errors import NodeFailure
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Hello


def test_what_a_node_can_say_is_passed_on() -> None:
    hello = Hello("a", 5, NEVER_NS, ["radio", "can"], [("x", "m"), ("y", "m")], [1])

    assert credible("a", hello) is hello


@pytest.mark.parametrize(("hello", "said"), [
    (Hello("a", 0, 0, ["radio"], [("x", "m"), ("x", "1")]), "signal 'x' twice"),
    (Hello("a", 0, 0, ["radio", "radio"], []), "port 'radio' twice"),
    (Hello("a", 0, 0, ["radio"], [("", "m")]), "a signal without a name"),
    (Hello("a", 0, 0, ["radio"], [], [1]), "port 1 of its 1"),
    (Hello("a", 0, 0, ["radio"], [], [-1]), "port -1 of its 1"),
    (Hello("a", -1, 0, ["radio"], []), "its first event at -1 ns"),
    (Hello("a", 0, -5, ["radio"], []), "its silence at -5 ns"),
    (Hello("b", 0, 0, ["radio"], []), "its name 'b'"),
    (Hello("a", 0, 0, ["radio"], [("s" * 10**6, "m")] * 2), f"signal {'s' * 40!r} twice"),
])
def test_nonsense_names_the_node_and_what_it_said(hello: Hello, said: str) -> None:
    with pytest.raises(NodeFailure, match=rf"node a: sent an invalid hello: {re.escape(said)}") as failure:
        credible("a", hello)

    assert failure.value.exit_code == 3
    assert len(str(failure.value)) < 300
