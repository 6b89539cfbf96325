"""Patterns of lost frames on one link within its limits: extremal, random, mutated.

    greedy     a frame that is wanted lost is lost if the limits still allow it, the earliest first
    phase p    all frames from p on are wanted lost: M lost, 1 delivered, M lost, ... beginning with frame p
    spread     the wanted frames are as far apart as M of K allows

A pattern is the sorted numbers of the lost frames. All are made by `greedy`, so that none breaks a limit.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from random import Random

from experiments.search.budget import LossLimit, breach

Pattern = tuple[int, ...]


def greedy(wanted: Sequence[int], limits: Sequence[LossLimit]) -> Pattern:
    """Return those of `wanted`, in ascending order, that can be lost when each is taken as soon as it is allowed."""
    lost: list[int] = []
    for number in wanted:
        # The window that ends with `number` holds all losses that may conflict, as later ones are not taken yet.
        if all(len(lost) - bisect_left(lost, number - limit.of + 1) < limit.most for limit in limits):
            lost.append(number)
    return tuple(lost)


def extremal(frames: int, limits: Sequence[LossLimit]) -> Iterator[Pattern]:
    """Yield patterns of a link with so many frames that use the limits up, in all phases."""
    window = max(limit.of for limit in limits)
    for phase in range(min(window, frames)):
        yield greedy(range(phase, frames), limits)
    for limit in limits:
        if limit.of > limit.most + 1:
            for phase in range(min(limit.of, frames)):
                yield greedy([number for number in range(frames)
                              if (number + phase) * limit.most % limit.of < limit.most], limits)


def randomly(frames: int, limits: Sequence[LossLimit], rng: Random) -> Pattern:
    """Return a pattern in which each frame is wanted lost with one drawn probability."""
    share = rng.random()
    return greedy([number for number in range(frames) if rng.random() < share], limits)


def mutated(pattern: Pattern, frames: int, limits: Sequence[LossLimit], rng: Random) -> Pattern:
    """Return the pattern shifted, drawn anew in a stretch, filled up, or with a few frames changed."""
    choice = rng.random()
    if choice < 0.25:
        by = 1 + int(rng.random() * max(limit.of for limit in limits))
        by = by if rng.random() < 0.5 else -by
        return greedy(sorted(number + by for number in pattern if 0 <= number + by < frames), limits)
    start, end = sorted(int(rng.random() * (frames + 1)) for _ in range(2))
    outside = {number for number in pattern if not start <= number < end}
    if choice < 0.5:
        share = rng.random()
        return greedy(sorted(outside | {n for n in range(start, end) if rng.random() < share}), limits)
    if choice < 0.75:
        return greedy(sorted(set(pattern) | set(range(start, end))), limits)
    flipped = {int(rng.random() * frames) for _ in range(1 + int(rng.random() * 3))} if frames else set()
    return greedy(sorted(set(pattern) ^ flipped), limits)


def crossed(one: Pattern, other: Pattern, frames: int, limits: Sequence[LossLimit], rng: Random) -> Pattern:
    """Return the beginning of one pattern and the rest of the other."""
    at = int(rng.random() * (frames + 1))
    return greedy([n for n in one if n < at] + [n for n in other if n >= at], limits)


def repeating(pattern: Pattern, frames: int, limits: Sequence[LossLimit]) -> tuple[Pattern, int | None]:
    """Return the pattern's first period and its length, if it repeats at least twice, else the pattern and None.

    A pattern that repeats goes on beyond `frames`, and stays within the limits.
    """
    if not pattern:
        return pattern, None
    lost = set(pattern)
    for period in range(1, min(frames // 2, 2 * max(limit.of for limit in limits)) + 1):
        first = tuple(number for number in pattern if number < period)
        if first and all((number % period in first) == (number in lost) for number in range(frames)):
            longer = frames + max(limit.of for limit in limits) + period
            if not breach([n for n in range(longer) if n % period in first], limits):
                return first, period
    return pattern, None
