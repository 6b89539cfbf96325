"""What a tracking scenario is refused for: ports and plants that its programs need."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest

from agents.tracking.check import companion_problems, reference_problems
from agents.tracking.tracking_robot import TrackingSettings
from firmware_sim.scenario_view import OwnAgent

ROBOT = {"wheel_radius_m": 0.1, "track_m": 0.5, "counts_per_turn": 1000}


def asked(team: Mapping[str, Any], media: tuple[str, ...], *, plant: bool = True) -> tuple[Any, Any]:
    """Return the arguments of `check`: a scenario, and the only agent that runs the program, by name."""
    agent = SimpleNamespace(program="a:B", plant=object() if plant else None, media=media)
    scenario = SimpleNamespace(team=team, media={}, impairments=[], length_ns=10**9,
                               agents={"r1": agent, "other": SimpleNamespace(program="c:D")})
    return scenario, {"r1": OwnAgent("r1", TrackingSettings(), agent)}


def test_a_companion_with_its_two_ports_and_its_wheels_is_fine() -> None:
    assert list(companion_problems(*asked({"robot": ROBOT}, ("can", "radio", "more")))) == []


def test_a_companion_on_media_of_other_names_is_told_which_it_lacks() -> None:
    assert list(companion_problems(*asked({"robot": ROBOT}, ("wifi", "can")))) == [
        "agents.r1.media: lacks radio; it has wifi, can, and its program speaks on media of these names"]


def test_a_companion_is_told_all_mistakes_at_once() -> None:
    team = {"gains": {"planned": [[1.0, 1.0, 53.0]], "unified": 9.0}, "robot": {"track_m": 0.5}}

    said = list(companion_problems(*asked(team, ())))

    assert [line.partition(":")[0] for line in said] == ["agents.r1.parameters", "team.robot", "agents.r1.media"]
    assert said[2].startswith("agents.r1.media: lacks radio, can; it has none")


@pytest.mark.parametrize("from_s", [[0.0], [0, 2.26, 9.25], [0.0, 1.0, -1.0, -1.0], []])
def test_pieces_may_end_and_some_may_not_be_in_use(from_s: list[float]) -> None:
    assert list(reference_problems(*asked({"reference": {"from_s": from_s}}, ("radio",)))) == []


@pytest.mark.parametrize("from_s", [3.0, "0", [0.0, 2.0, 2.0], [1.0, 0.5], ["0"], [float("inf")], [None]])
def test_instants_that_are_none_are_refused(from_s: object) -> None:
    said, = reference_problems(*asked({"reference": {"from_s": from_s}}, ("radio",)))

    assert said == f"team.reference.from_s={from_s}: expected a list of later and later instants [s]"


def test_a_reference_without_anything_is_told_all_it_lacks() -> None:
    said = list(reference_problems(*asked({}, (), plant=False)))

    assert [line.partition(":")[0] for line in said] == ["agents.r1.plant", "team.reference.from_s", "agents.r1.media"]
