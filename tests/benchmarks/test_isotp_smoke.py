"""The benchmark of can-isotp in small: it measures a message that arrives, also without flow control."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from experiments.run.runner import run
from experiments.scenario.loader import load_tables

pytest.importorskip("isotp", reason="can-isotp is not installed; get it with: pip install 'marconet[clients]'")
SIZE, BIT_RATE = 1_000, 500_000
FRAMES = 1 + -(-(SIZE - 6) // 7)                # a first frame with 6 bytes, then 7 in each


@pytest.mark.parametrize("blocksize", [8, 0])
def test_a_message_takes_at_least_the_time_of_its_bits_and_one_hash(blocksize: int) -> None:
    from benchmarks.isotp import measured

    inline, processes = (measured(SIZE, BIT_RATE, blocksize, host) for host in ("inline", "process"))

    assert inline.ledger_hash == processes.ledger_hash
    assert inline.bus_s >= FRAMES * 108 / BIT_RATE      # 108 bits in a frame of 8 bytes, without stuff bits


def test_without_flow_control_a_controllers_queue_that_is_too_short_loses_frames(tmp_path: Path) -> None:
    from benchmarks.isotp import tables

    short: dict[str, Any] = tables(SIZE, BIT_RATE, blocksize=0)
    short["media"]["can0"]["queue_frames"] = 32

    summary = run(load_tables(short, "Does it?", Path(__file__)), host="inline", out=tmp_path, report=False).summary

    assert not summary.holds
    assert summary.frames["queue full"] == FRAMES - 1 - 32  # of its burst at one instant, 32 wait
