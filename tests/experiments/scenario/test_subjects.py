"""What `on` names, and what it says when it names nothing."""

from __future__ import annotations

import pytest

from experiments.scenario.subjects import Named, subjects_of

NODES_ON = {"radio": ("r1", "r2", "base"), "can": ("base", "drive"), "mocap": ("drive", "uav")}
LINKS = [("radio", "r1", "r2"), ("radio", "r2", "base"), ("can", "base", "drive"), ("can", "drive", "base"),
         ("mocap", "uav", "uav"), ("mocap", "drive", "uav")]
REPORTING = ["r1", "r2", "base", "drive", "error"]


@pytest.mark.parametrize(("named", "on", "subjects"), [
    (Named.LINKS, "radio: * -> *", [("radio", "r1", "r2"), ("radio", "r2", "base")]),
    (Named.LINKS, "can: base <-> drive", [("can", "base", "drive"), ("can", "drive", "base")]),
    (Named.LINKS, "*: * -> base", [("radio", "r2", "base"), ("can", "drive", "base")]),
    (Named.LINKS, "mocap: uav -> uav", [("mocap", "uav", "uav")]),
    (Named.LINKS, "mocap: * -> uav", [("mocap", "drive", "uav"), ("mocap", "uav", "uav")]),
    (Named.SENDERS, "radio: r1", [("radio", "r1")]),
    (Named.SENDERS, "*: b*", [("radio", "base"), ("can", "base")]),
    (Named.SENDERS, " radio : r? ", [("radio", "r1"), ("radio", "r2")]),
    (Named.SIGNALS, "r*.y.x", [("r1", "y.x"), ("r2", "y.x")]),
    (Named.SIGNALS, "error.x1", [("error", "x1")]),
    (Named.EVENTS, "base.gain product", [("base", "gain product")]),
])
def test_names_and_patterns(named: Named, on: str, subjects: list[tuple[str, ...]]) -> None:
    assert subjects_of(named, on, NODES_ON, LINKS, REPORTING) == subjects


@pytest.mark.parametrize(("named", "on", "says"), [
    (Named.LINKS, "radio: r1 -> base", "no such link at any time of the run; nearest: 'radio: r"),
    (Named.LINKS, "radio: r9 -> r1", "'r9' names no node on medium 'radio': nearest: 'r"),
    (Named.LINKS, "radio r1 -> r2", 'expected "medium: sender -> receiver"'),
    (Named.SENDERS, "radio r1", 'expected "medium: node"'),
    (Named.SENDERS, "radio: r1 -> r2", 'expected "medium: node"'),
    (Named.SENDERS, "radoi: r1", "'radoi' names no medium; nearest: 'radio'"),
    (Named.SENDERS, "can: r1", "'r1' names no node on that medium; expected one of base, drive"),
    (Named.SIGNALS, "r1", 'expected "node.signal"'),
    (Named.SIGNALS, ".y", 'expected "node.signal"'),
    (Named.SIGNALS, "r3.y", "'r3' names no node; nearest: 'r"),
    (Named.EVENTS, "r1.", 'expected "node.kind of event"'),
])
def test_what_names_nothing_is_refused_with_the_nearest(named: Named, on: str, says: str) -> None:
    with pytest.raises(ValueError) as error:
        subjects_of(named, on, NODES_ON, LINKS, REPORTING)

    assert says in str(error.value)
