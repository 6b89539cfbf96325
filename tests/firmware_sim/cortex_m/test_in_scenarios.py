"""Boards with an emulated Cortex-M on a medium: the same run on both hosts and in every repetition."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import marconet
from marconet import Run

SCENARIO = """
seed = 3
length_s = 0.2

[agents_defaults]
program = "firmware_sim.cortex_m.program:CortexM"

[agents.a]
parameters = {{ image = "{image}", values = [[5e6], [1e6], [{rounds}]], cycles_per_instruction = {cost} }}

[agents.b]
parameters = {{ image = "{image}", values = [[4e6], [3e6], [{rounds}]], cycles_per_instruction = {cost} }}
clock = {{ drift_ppm = 100.0, offset_ns = -500_000 }}

[media.radio]
kind = "broadcast_radio"
bit_rate_bps = 250_000
decode = "local"
"""


def run(image: Path, folder: Path, host: str = "inline", rounds: int = 0, cost: float = 0.0) -> Run:
    folder.mkdir()
    scenario = folder / "pair.toml"
    scenario.write_text(SCENARIO.format(image=image, rounds=rounds, cost=cost))
    return marconet.run(scenario, host=host, out=folder / "run")


@pytest.mark.parametrize(("rounds", "cost"), [(0, 0.0), (2_000, 1.0)])
def test_both_hosts_and_all_repetitions_give_one_hash(image: Callable[..., Path], tmp_path: Path, rounds: int,
                                                      cost: float):
    built = image("beacon")
    runs = [run(built, tmp_path / f"{host}{k}", host, rounds, cost)
            for k, host in enumerate(["inline", "inline", "process"])]

    assert len({one.ledger_hash for one in runs}) == 1
    assert len(runs[0].ledger) == 40 + 50
    assert set(runs[0].ledger["fate"]) == {"delivered"}
