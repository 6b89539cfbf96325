"""Teams that share the slots of one radio are refused if some robot is not on it, or not in the team table."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.scenario import ScenarioError, find, load

BUS = 'media.radio={kind="can", bit_rate_bps=500000}'
OTHER = '\n[media.other]\nkind = "broadcast_radio"\npreset = "ideal"\ndecode = "local"\n'


@pytest.mark.parametrize("name", ["output_sync_reference", "output_sync_waves"])
@pytest.mark.parametrize(("more", "override", "words"), [
    ("", BUS, "media.radio: robots that share slots need a broadcast_radio"),
    (OTHER, 'agents.r1.media=["other"]', "expected all robots on one and the same medium"),
    ('\n[agents.r9]\nplant = { fmu = "linear_system" }\n', "seed=1", "expected exactly the agents of the scenario")])
def test_a_team_that_is_not_on_one_radio_is_refused(tmp_path: Path, name: str, more: str, override: str,
                                                    words: str) -> None:
    (tmp_path / "s.toml").write_text(find(name).read_text() + more)

    with pytest.raises(ScenarioError, match=words):
        load(tmp_path / "s.toml", overrides=["impairments=[]", "guarantees={}", "expect={}", override])
