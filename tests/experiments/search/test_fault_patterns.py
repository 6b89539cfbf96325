"""Faults that a search draws: every kind answers for itself, every draw loads and acts, and none meets another."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from pyarrow.parquet import read_table

from experiments.run.runner import run
from experiments.scenario import find, load
from experiments.scenario.faults import site_for_search
from experiments.search.budget import BadBudget, Budget
from experiments.search.fault_patterns import FaultSpace
from netem.core.random_streams import stream
from netem.faults import Site
from netem.faults.candidates import Between, Fixed, OneOf, ShareOfLength, Vector
from netem.faults.table import FAULTS
from netem.records.events_file import FILE as EVENTS

SITE = Site(("a", "b", "c"), {"radio": ("a", "b", "c")}, {})
LENGTH_NS = 4_500_000_000
# A radio between robots, a CAN bus and a camera in each, plants with inputs and tunable parameters, execution times.
EVERYTHING, LINKS = "two_p3at_chase_rovio", (
    ("radio", "pursuer_fast", "center"), ("view_fast", "rovio", "pursuer_fast"),
    ("view_slow", "rovio", "pursuer_slow"))


def space(most: int, *kinds: str, planned: Path | None = None) -> FaultSpace:
    faults = () if planned is None else load(planned).faults
    return FaultSpace(Budget(faults=most, kinds=kinds), SITE, LENGTH_NS, faults)


@cache
def site_with_everything() -> Site:
    return site_for_search(load(find(EVERYTHING)), LINKS)


def test_what_nothing_in_the_scenario_can_take_is_no_choice() -> None:
    choices = space(1).choices

    kinds = {kind for kind, _ in choices}
    assert kinds == {"kill", "pause", "clock_step", "clock_drift", "link_down", "undetected_corruption", "partition"}
    assert [candidate.on for kind, candidate in choices if kind == "kill"] == ["a", "b", "c"]
    assert len([candidate.on for kind, candidate in choices if kind == "link_down"]) == 6
    # The first of each kind comes before the second of any, so that a short search tries each kind.
    assert {kind for kind, _ in choices[:len(kinds)]} == kinds


def test_every_kind_has_candidates_where_all_is_there() -> None:
    site = site_with_everything()

    without = [kind for kind, fault in FAULTS.items() if not fault.candidates(site)]

    assert without == []
    assert {candidate.on for candidate in FAULTS["blackout"].candidates(site)} == {
        "view_fast: rovio -> pursuer_fast", "view_slow: rovio -> pursuer_slow"}
    assert {candidate.on for candidate in FAULTS["jam"].candidates(site)} == {"radio"}


@pytest.mark.parametrize("kind", FAULTS)
def test_whatever_is_drawn_of_a_kind_loads_and_acts(kind: str, tmp_path: Path) -> None:
    length_ns = 300_000_000
    found = FaultSpace(Budget(faults=2, kinds=(kind,)), site_with_everything(), length_ns, ())
    rng, faults = stream(1, kind), found.randomly(stream(2, kind))

    for _ in range(12):
        faults = found.mutated(faults, rng)
        tables = [fault.table() for fault in faults]
        loaded = load(find(EVERYTHING), values={"faults": tables, "length_s": length_ns / 1e9})
        assert tables
        assert [(spec.kind, len(spec.occurrences)) for spec in loaded.faults] == [(kind, 1)] * len(tables)
        assert all(f"{kind} of {fault.on}" in fault.in_words() for fault in faults)
    (first,) = FaultSpace(Budget(faults=1, kinds=(kind,)), site_with_everything(), length_ns, ()).randomly(rng)
    table = first.table() | {"at_s": 0.1}
    run(load(find(EVERYTHING), values={"faults": [table], "length_s": 0.3, "guarantees": {}, "expect": {}}),
        host="inline", out=tmp_path / "run", report=False)
    told = read_table(tmp_path / "run" / EVENTS)["kind"].to_pylist()
    assert "fault" in told
    assert "fault without effect" not in told


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


@pytest.mark.parametrize(("kind", "needs"), [
    ("bus_off", "a CAN bus with two nodes or more"), ("blackout", "a sensing medium, and a body that is seen"),
    ("slow", r"a program that asks board\.execution_ns"), ("plant_input", "a plant with an input of a real type")])
def test_a_kind_that_nothing_can_take_is_refused_if_it_is_named(kind: str, needs: str) -> None:
    with pytest.raises(BadBudget, match=f"^--budget faults of {kind}: nothing in the scenario takes one: it needs "
                                        f"{needs}; leave this kind out$"):
        space(1, "kill", kind)


def test_ranges_draw_what_they_say() -> None:
    rng = stream(3, "ranges")
    between = [Between(0.5, 1.5).draw(rng, 1) for _ in range(500)]
    signed = [Between(0.0, 2.0, signed=True).draw(rng, 1) for _ in range(500)]
    times = [ShareOfLength(0.1, signed=True).draw(rng, 1000) for _ in range(500)]

    assert 0.5 <= min(between) < 0.52
    assert 1.48 < max(between) <= 1.5
    assert all(0 < abs(value) <= 2 for value in signed)
    # Of 500 fair signs at least 4 standard deviations below the mean are positive.
    assert 250 - 45 < sum(value > 0 for value in signed) < 250 + 45
    assert (min(times), max(times), 0 in times) == (-100, 100, False)
    assert {OneOf((1, 2)).draw(rng, 1) for _ in range(50)} == {1, 2}
    assert Fixed(("a",)).draw(rng, 1) == ("a",)
    assert len(Vector(3, 1.0).draw(rng, 1)) == 3
