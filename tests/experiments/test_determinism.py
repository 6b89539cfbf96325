"""The same scenario and seed give the same ledger, whatever the load, the start order and the host."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import find, load

LOSSES = 'impairments=[{on="radio: * -> *", kind="gilbert_elliott", loss_ratio=0.02, mean_burst_frames=2.0}]'


def burn() -> None:
    while True:
        sum(range(1000))


@contextmanager
def background_load(processes: int) -> Iterator[None]:
    started = [multiprocessing.get_context("spawn").Process(target=burn, daemon=True) for _ in range(processes)]
    for process in started:
        process.start()
    try:
        yield
    finally:
        for process in started:
            process.terminate()
            process.join()
            process.close()


def hash_of(folder: Path, host: HostName, start_order: int, duration_s: float, seed: int = 7) -> str:
    scenario = load(find("output_sync"), seed=seed, duration_s=duration_s, overrides=[LOSSES])
    return run(scenario, host=host, out=folder / f"{host}-{start_order}", report=False,
               shuffle_start=start_order).summary.ledger_hash


def test_load_start_order_and_host_change_nothing(tmp_path: Path) -> None:
    hashes = {hash_of(tmp_path, "inline", 0, 0.2)}

    with background_load(2):
        hashes |= {hash_of(tmp_path, "process", order, 0.2) for order in range(2)}

    assert len(hashes) == 1
    assert hash_of(tmp_path, "inline", 99, 0.2, seed=8) not in hashes


SETS = """
class Namer:
    def __init__(self, board):
        self.board = board

    def run(self):
        yield self.board.until(1_000_000)
        for word in {"one", "two", "three", "four", "five", "six", "seven", "eight"}:
            self.board.port("radio").send(word.encode())
"""
NAMERS = """# Robots that go through a set.
# Question: does its order change?
seed = 1
length_s = 0.01
[agents.r1]
program = "namer:Namer"
[agents.r2]
program = "namer:Namer"
[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"
mac = "aloha"
[expect]
frames_offered = { min = 1 }
"""


def test_a_program_that_goes_through_a_set_of_names_says_the_same_in_every_run(tmp_path: Path) -> None:
    """Python shuffles sets of text anew in every process unless it is told not to: one chance in 40 320 to miss it."""
    (tmp_path / "namer.py").write_text(SETS)
    (tmp_path / "namers.toml").write_text(NAMERS)

    hashes = {run(load(tmp_path / "namers.toml"), host="process", out=tmp_path / f"{k}", report=False
                  ).summary.ledger_hash for k in range(3)}

    assert len(hashes) == 1


@pytest.mark.slow
def test_thirty_runs_give_one_hash(tmp_path: Path) -> None:
    hashes = {hash_of(tmp_path, "inline", order, 1.0) for order in range(10)}

    with background_load(2):
        hashes |= {hash_of(tmp_path, "process", order, 1.0) for order in range(10, 30)}

    assert len(hashes) == 1
    assert hash_of(tmp_path, "inline", 99, 1.0, seed=8) not in hashes
