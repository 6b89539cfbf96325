"""Redraws docs/models/marco_polo_losses.svg: captures of `marco_polo` over the radio's loss ratio, for N^D = 0 to 3.

    python -m benchmarks.marco_polo_losses [--seeds 100] [--out runs/marco_polo_losses] [--jobs N]

Four campaigns, one for each N^D, of the same games: loss ratios from 0 to 0.95 on every link of the radio of bids, and
seeds from 1000 on. The window of each is the least that N^D asks for, so repetition has its price. A folder that is
there is gone on with.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Final

import marconet
from agents.bidding.bid_timing import BiddingSettings, BidTiming

SENSORS: Final = ("uav_1", "uav_2", "ugv_1", "ugv_2", "ugv_3", "ugv_4", "ugv_5")
REPEATS: Final = (0, 1, 2, 3)                                   # N^D
RATIOS: Final = (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 0.95)
SLOT_NS: Final = 5_000_000
TARGETS: Final = 3
LOSS: Final = "impairments[0].loss_ratio"
FIGURES: Final = ("target_*.captured", "*.detections", "*.windows", "*.deployments", "*.let go", "*.sensors silent",
                  "*.investigations", "*.pursuits")


def window_ns(losses: int) -> int:
    """Return the least bid window [ns] of seven sensors for N^D = `losses`."""
    return BidTiming(len(SENSORS), BiddingSettings(slot_ns=SLOT_NS, window_ns=1, max_successive_losses=losses)
                     ).least_window_ns


def played(losses: int, seeds: int, out: Path, jobs: int | None) -> Any:
    """Return the runs of the campaign with N^D = `losses`, a row for each game."""
    changes: dict[str, Any] = {
        "impairments": [{"on": "radio: * -> *", "kind": "bernoulli_loss", "loss_ratio": 0.0}],
        "expect": {f"count.{figure}": {"min": 0} for figure in FIGURES}}
    for sensor in SENSORS:
        changes[f"agents.{sensor}.parameters.max_successive_losses"] = losses
        changes[f"agents.{sensor}.parameters.window_ms"] = window_ns(losses) // 1_000_000
    folder = out / f"repeats_{losses}"
    return marconet.sweep("marco_polo", {LOSS: list(RATIOS)}, seeds=seeds, first_seed=1000, set=changes, jobs=jobs,
                          resume=folder.exists(), out=folder, folders=0).runs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--jobs", type=int)
    parser.add_argument("--out", type=Path, default=Path("runs/marco_polo_losses"))
    arguments = parser.parse_args()
    for losses in REPEATS:
        print(losses, played(losses, arguments.seeds, arguments.out, arguments.jobs).group_by(LOSS).mean())


if __name__ == "__main__":
    main()
