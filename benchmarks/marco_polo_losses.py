"""Redraws docs/models/marco_polo_losses.svg: captures of `marco_polo` over the radio's loss ratio, for N^D = 0 to 3.

    python -m benchmarks.marco_polo_losses [--seeds 100] [--out runs/marco_polo_losses] [--jobs N]

Four campaigns, one for each N^D, of the same games: loss ratios from 0 to 0.95 on every link of the radio of bids, and
seeds from 1000 on. The window of each is the least that N^D asks for, so repetition has its price. A folder that is
there is gone on with. It prints, as tables of Markdown, the captures with exact intervals; N^D against N^D + 1 at each
loss ratio by a permutation test of the pairs of games, two-sided, p adjusted by Holm; and what the sensors did.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import marconet
from agents.bidding.bid_timing import BiddingSettings, BidTiming
from experiments.judge.campaign_statistics import Estimate, share

SENSORS: Final = ("uav_1", "uav_2", "ugv_1", "ugv_2", "ugv_3", "ugv_4", "ugv_5")
REPEATS: Final = (0, 1, 2, 3)                                   # N^D
RATIOS: Final = (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 0.95)
SLOT_NS: Final = 5_000_000
TARGETS: Final = 3
LEVEL: Final = 0.05
RESAMPLES: Final = 20_000
LOSS: Final = "impairments[0].loss_ratio"
CAPTURED: Final = "count.target_*.captured"
FIGURES: Final = ("*.detections", "*.windows", "*.deployments", "*.let go", "*.sensors silent", "*.investigations",
                  "*.pursuits")
FIGURE: Final = Path(__file__).parents[1] / "docs" / "models" / "marco_polo_losses.svg"
COLOURS: Final = ("#c0392b", "#b9770e", "#1e8449", "#2471a3")
Games = Mapping[float, Mapping[str, NDArray[np.float64]]]       # by loss ratio and figure, in the order of seeds


def window_ns(losses: int) -> int:
    """Return the least bid window [ns] of seven sensors for N^D = `losses`."""
    return BidTiming(len(SENSORS), BiddingSettings(slot_ns=SLOT_NS, window_ns=1, max_successive_losses=losses)
                     ).least_window_ns


def played(losses: int, seeds: int, out: Path, jobs: int | None) -> Games:
    """Return the games of the campaign with N^D = `losses`."""
    changes: dict[str, Any] = {
        "impairments": [{"on": "radio: * -> *", "kind": "bernoulli_loss", "loss_ratio": 0.0}],
        "expect": {key: {"min": 0} for key in (CAPTURED, *(f"count.{figure}" for figure in FIGURES))}}
    for sensor in SENSORS:
        changes[f"agents.{sensor}.parameters.max_successive_losses"] = losses
        changes[f"agents.{sensor}.parameters.window_ms"] = window_ns(losses) // 1_000_000
    folder = out / f"repeats_{losses}"
    runs = marconet.sweep("marco_polo", {LOSS: list(RATIOS)}, seeds=seeds, first_seed=1000, set=changes, jobs=jobs,
                          resume=folder.exists(), out=folder, folders=0).runs.sort("seed")
    if failed := [row["failure"] for row in runs.to_dicts() if row["failure"]]:
        raise SystemExit(f"{len(failed)} games failed, the first one: {failed[0]}")
    return {ratio: {key: part[key].to_numpy() for key in part.columns if key.startswith("count.")}
            for ratio in RATIOS for part in [runs.filter(runs[LOSS] == ratio)]}


def captures(game: Mapping[str, NDArray[np.float64]]) -> Estimate:
    """Return the share of targets that were captured, each of them taken for a trial of its own."""
    caught = game[CAPTURED]
    return share(int(caught.sum()), TARGETS * caught.size)


def spread(game: Mapping[str, NDArray[np.float64]]) -> float:
    """Return the variance of captures over games, over that of independent targets; nan without captures."""
    caught = game[CAPTURED]
    chance = caught.mean() / TARGETS
    return float(caught.var(ddof=1) / (TARGETS * chance * (1 - chance))) if 0 < chance < 1 else float("nan")


def comparisons(games: Mapping[int, Games]) -> dict[tuple[int, float], tuple[float, float]]:
    """Return for (N^D, loss ratio) the captures in a game that one more repetition adds, and its adjusted p."""
    from scipy.stats import permutation_test

    added, raw = {}, {}
    for fewer, more in pairwise(REPEATS):
        for ratio in RATIOS:
            difference = games[more][ratio][CAPTURED] - games[fewer][ratio][CAPTURED]
            added[fewer, ratio] = float(difference.mean())
            raw[fewer, ratio] = 1.0 if not difference.any() else float(permutation_test(
                (difference,), np.mean, permutation_type="samples", n_resamples=RESAMPLES,
                rng=np.random.default_rng(0)).pvalue)
    return {key: (added[key], p) for key, p in holm(raw).items()}


def holm(p: Mapping[tuple[int, float], float]) -> dict[tuple[int, float], float]:
    """Return p-values adjusted for their number (Holm 1979)."""
    adjusted, least = {}, 0.0
    for place, key in enumerate(sorted(p, key=lambda key: p[key])):
        least = max(least, min(1.0, p[key] * (len(p) - place)))
        adjusted[key] = least
    return adjusted


def row(head: str, cells: Iterable[str]) -> str:
    return f"| {head} | {' | '.join(cells)} |"


def tables(games: Mapping[int, Games]) -> str:
    head = [row("loss ratio", map(str, RATIOS)), "|---" * (len(RATIOS) + 1) + "|"]
    lines = ["captures in a game, of three targets", *head]
    for losses in REPEATS:
        found = [captures(games[losses][ratio]) for ratio in RATIOS]
        lines.append(row(f"N^D = {losses}, W = {window_ns(losses) // 1_000_000} ms", (
            f"{TARGETS * each.value:.2f} [{TARGETS * (each.low or 0):.2f}, {TARGETS * (each.high or 0):.2f}]"
            for each in found)))
    lines += ["", "captures that one more repetition adds to a game, p", *head]
    compared = comparisons(games)
    for losses in REPEATS[:-1]:
        lines.append(row(f"{losses} to {losses + 1}", (
            f"{'**' * (p < LEVEL)}{added:+.2f}{'**' * (p < LEVEL)}, {p:.2g}"
            for added, p in (compared[losses, ratio] for ratio in RATIOS))))
    for figure in FIGURES:
        lines += ["", f"{figure} in a game", *head]
        lines += [row(f"N^D = {losses}", (f"{games[losses][ratio][f'count.{figure}'].mean():.2f}" for ratio in RATIOS))
                  for losses in REPEATS]
    spreads = [spread(games[losses][ratio]) for losses in REPEATS for ratio in RATIOS]
    return "\n".join([*lines, "", "variance over games, of that of independent targets: median "
                      f"{np.nanmedian(spreads):.2f}, "
                      f"{np.nanmin(spreads):.2f} to {np.nanmax(spreads):.2f}"])


def svg(games: Mapping[int, Games]) -> str:
    def at(ratio: float, caught: float) -> tuple[float, float]:
        return 60 + 620 * ratio, 320 - 250 * caught

    lines = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 380" font-family="sans-serif" font-size="13">'
             '<rect width="720" height="380" fill="white"/>']
    for tenth in range(0, 11, 2):
        x, y = at(tenth / 10, tenth / 10)
        lines.append(f'<path d="M60 {y:.1f}H680" stroke="#ddd"/><text x="52" y="{y:.1f}" dy="4" text-anchor="end">'
                     f'{tenth / 10:g}</text><text x="{x:.1f}" y="338" text-anchor="middle">{tenth / 10:g}</text>')
    lines.append('<text x="370" y="362" text-anchor="middle">loss ratio of each link of the radio</text>'
                 '<text x="60" y="28">captures in a game, of three targets; bars: 95 %, Clopper and Pearson</text>')
    for losses, colour in zip(REPEATS, COLOURS, strict=True):
        points = []
        for ratio in RATIOS:
            found = captures(games[losses][ratio])
            x, y = at(ratio, TARGETS * found.value)
            x += 4 * (losses - 1.5)
            points.append(f"{x:.1f},{y:.1f}")
            low, high = (at(ratio, TARGETS * (end or 0.0))[1] for end in (found.low, found.high))
            lines.append(f'<path d="M{x:.1f} {low:.1f}V{high:.1f}" stroke="{colour}"/>'
                         f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>')
        lines.append(f'<polyline points="{" ".join(points)}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
                     f'<text x="540" y="{60 + 18 * losses}" fill="{colour}">N^D = {losses}, window '
                     f'{window_ns(losses) // 1_000_000} ms</text>')
    return "\n".join(lines) + "\n</svg>\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--jobs", type=int)
    parser.add_argument("--out", type=Path, default=Path("runs/marco_polo_losses"))
    arguments = parser.parse_args()
    games = {losses: played(losses, arguments.seeds, arguments.out, arguments.jobs) for losses in REPEATS}
    print(tables(games))
    FIGURE.write_text(svg(games), encoding="utf-8")
    print(FIGURE)


if __name__ == "__main__":
    main()
