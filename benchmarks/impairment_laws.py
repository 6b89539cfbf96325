"""Draws the figure of docs/models/impairments.md: loss bursts and correlated delays, compared with their laws.

    python -m benchmarks.impairment_laws [--frames 100000] [--out docs/models/impairments.svg]

Left: share of loss bursts longer than k frames. Right: distribution of a normal delay with correlation 0.9, and that of
Linux netem's generator, which mixes the last draw with a new one, with the same settings.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from itertools import groupby
from math import log10
from pathlib import Path
from statistics import NormalDist

from netem.core.random_streams import stream
from netem.core.transit import Transit
from netem.impairments.bernoulli_loss import BernoulliLoss
from netem.impairments.delay import Delay
from netem.impairments.gilbert_elliott import GilbertElliott

MS = 1_000_000
DELAY_MS, JITTER_MS, CORRELATION = 20, 5, 0.9
LOSSES: list[tuple[str, str, BernoulliLoss | GilbertElliott, float]] = [     # label, colour, impairment, mean burst
    ("bernoulli_loss 0.3", "#c0392b", BernoulliLoss(0.3, rng=stream(7, "bernoulli")), 1 / 0.7),
    ("gilbert_elliott 0.3, mean 5", "#1f618d", GilbertElliott(0.3, 5, rng=stream(7, "five")), 5),
    ("gilbert_elliott 0.3, mean 12", "#117a65", GilbertElliott(0.3, 12, rng=stream(7, "twelve")), 12),
]
WIDTH, HEIGHT, TOP, BOTTOM, PANEL = 860, 380, 20, 50, 350
LEFT = (55, 495)                        # left edges of the two panels
LONGEST = 40

Point = tuple[float, float]


def transits(frames: int) -> Iterable[Transit]:
    return (Transit(n, n * MS, n * MS, b"frame") for n in range(frames))


def bursts_longer_than(impairment: BernoulliLoss | GilbertElliott, frames: int) -> list[float]:
    lost = [not list(impairment.carry(transit)) for transit in transits(frames)]
    bursts = [len(list(run)) for bad, run in groupby(lost) if bad]
    return [sum(length > k for length in bursts) / len(bursts) for k in range(LONGEST + 1)]


def delays_ms(frames: int) -> list[float]:
    delay = Delay(DELAY_MS * MS, "normal", JITTER_MS * MS, CORRELATION, rng=stream(7, "delay"))
    copies = (copy for transit in transits(frames) for copy in delay.carry(transit))
    return sorted((copy.arrival_ns - copy.sent_ns) / MS for copy in copies)


def delays_as_netem_ms(frames: int) -> list[float]:
    rng, last, found = stream(7, "netem"), 0.5, []
    for _ in range(frames):
        last = CORRELATION * last + (1 - CORRELATION) * rng.random()
        found.append(max(0.0, DELAY_MS + JITTER_MS * NormalDist().inv_cdf(last)))
    return sorted(found)


def burst_point(k: float, share: float) -> Point:
    return LEFT[0] + k / LONGEST * PANEL, TOP - log10(share) / 3 * (HEIGHT - TOP - BOTTOM)


def delay_point(ms: float, share: float) -> Point:
    return LEFT[1] + ms / (2 * DELAY_MS) * PANEL, HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)


def line(points: Iterable[Point], colour: str, dash: str = "") -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.5" stroke-dasharray="{dash}"/>'


def dots(points: Iterable[Point], colour: str) -> list[str]:
    return [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points]


def text(x: float, y: float, words: str, anchor: str = "middle", colour: str = "#000") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{words}</text>'


def left_panel(frames: int) -> list[str]:
    parts = [text(LEFT[0] - 6, burst_point(0, share)[1] + 4, f"{share:g}", "end") for share in (1, 0.1, 0.01, 0.001)]
    parts += [text(burst_point(k, 1)[0], HEIGHT - BOTTOM + 18, f"{k}") for k in range(0, LONGEST + 1, 10)]
    parts.append(text(LEFT[0] + PANEL / 2, HEIGHT - 10, "k, frames (share of loss bursts longer than k)"))
    for row, (label, colour, impairment, mean) in enumerate(LOSSES):
        stay = 1 - 1 / mean
        law = [(k, stay ** k) for k in range(LONGEST + 1) if stay ** k >= 0.001]
        found = [(k, share) for k, share in enumerate(bursts_longer_than(impairment, frames)) if share >= 0.001]
        parts += [line([burst_point(*point) for point in law], colour), *dots([burst_point(*p) for p in found], colour),
                  text(LEFT[0] + PANEL, TOP + 16 + 18 * row, label, "end", colour)]
    return parts


def right_panel(frames: int) -> list[str]:
    parts = [text(LEFT[1] - 6, delay_point(0, share / 4)[1] + 4, f"{share / 4:g}", "end") for share in range(5)]
    parts += [text(delay_point(ms, 0)[0], HEIGHT - BOTTOM + 18, f"{ms}") for ms in range(0, 2 * DELAY_MS + 1, 10)]
    parts.append(text(LEFT[1] + PANEL / 2, HEIGHT - 10, "delay, ms (share of delays below)"))
    law, ours, netem = NormalDist(DELAY_MS, JITTER_MS), delays_ms(frames), delays_as_netem_ms(frames)
    every = range(1, 40)
    parts += [line([delay_point(ms / 4, law.cdf(ms / 4)) for ms in range(8 * DELAY_MS + 1)], "#1f618d"),
              line([delay_point(quantile(netem, n / 200), n / 200) for n in range(1, 200)], "#c0392b", "5 4"),
              *dots([delay_point(quantile(ours, n / 40), n / 40) for n in every], "#1f618d"),
              text(LEFT[1] + 10, TOP + 16, "correlation 0.9", "start", "#1f618d"),
              text(LEFT[1] + 10, TOP + 34, "with netem's mixing", "start", "#c0392b")]
    return parts


def quantile(ordered: Sequence[float], share: float) -> float:
    return ordered[int(share * len(ordered))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=100_000)
    parser.add_argument("--out", type=Path, default=Path("docs/models/impairments.svg"))
    arguments = parser.parse_args()
    frame = [f'<rect x="{left}" y="{TOP}" width="{PANEL}" height="{HEIGHT - TOP - BOTTOM}" fill="none" stroke="#ccc"/>'
             for left in LEFT]
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
            f'font-size="13"><rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>')
    parts = [head, *frame, *left_panel(arguments.frames), *right_panel(arguments.frames), "</svg>\n"]
    arguments.out.write_text("\n".join(parts))
    print(f"wrote {arguments.out}")


if __name__ == "__main__":
    main()
