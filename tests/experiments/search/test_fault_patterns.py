"""Faults that a search draws: every one loads, none is refused for meeting another, whatever is drawn and mutated."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.scenario import load
from experiments.search.budget import BadBudget, Budget
from experiments.search.fault_patterns import FaultSpace
from netem.core.random_streams import stream
from netem.faults import Fault, Site
from netem.faults.table import FAULTS

SITE = Site(("a", "b", "c"), {"radio": ("a", "b", "c")}, {})
LENGTH_NS = 4_500_000_000


def space(most: int, *kinds: str, planned: Path | None = None) -> FaultSpace:
    faults = () if planned is None else load(planned).faults
    return FaultSpace(Budget(faults=most, kinds=kinds), SITE, LENGTH_NS, faults)


def test_every_kind_that_can_be_drawn_is_a_choice_with_each_of_its_targets() -> None:
    drawn = [kind for kind in FAULTS if FAULTS[kind].draw(stream(0, kind), LENGTH_NS) is not None]

    choices = space(1).choices

    assert {kind for kind, _ in choices} == set(drawn) >= {"kill", "pause", "link_down", "partition", "clock_step"}
    assert [on for kind, on in choices if kind == "kill"] == ["a", "b", "c"]
    assert len([on for kind, on in choices if kind == "link_down"]) == 6


@pytest.mark.parametrize("kind", [kind for kind in FAULTS if FAULTS[kind].draw(stream(0, kind), LENGTH_NS) is not None])
def test_whatever_is_drawn_of_a_kind_loads(kind: str, watched: Path) -> None:
    found, rng = space(3, kind), stream(1, kind)

    for _ in range(20):
        tables = [fault.table() for fault in found.randomly(rng)]
        assert tables
        loaded = load(watched, values={"faults": tables})
        assert [(spec.kind, len(spec.occurrences)) for spec in loaded.faults] == [(kind, 1)] * len(tables)


def test_faults_that_take_a_node_away_never_overlap_nor_exceed_their_number(forty_faults: Path) -> None:
    """With pauses of a and b in the scenario already: the loader refuses what overlaps."""
    found, rng = space(3, "kill", "pause", planned=forty_faults), stream(1, "faults")
    planned = load(forty_faults).faults
    faults = found.randomly(rng)
    sizes = []

    for _ in range(150):
        faults = found.mutated(faults, rng)
        sizes.append(len(faults))
        tables = [fault.table() for fault in faults]
        document = [{"kind": "pause", "on": spec.on, "lasts_s": 0.07, "every_s": 0.2, "times": 20,
                     "at_s": spec.occurrences[0][0] / 1e9} for spec in planned]
        load(forty_faults, values={"faults": [*document, *tables]})

    assert max(sizes) == 3


def test_a_kind_that_cannot_be_drawn_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FAULTS["pause"], "draw", Fault.draw)

    with pytest.raises(BadBudget, match="faults of pause: a search cannot draw this kind; leave it out"):
        space(1, "pause")
