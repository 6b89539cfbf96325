"""What a campaign varies: `--vary 'KEY=a,b,c'` and `--vary 'KEY=lo:hi:n'`, as a grid or a Latin hypercube.

    grid     every combination of the values, the last key fastest
    latin    N settings: each key's range is cut into N equal parts, and each part is drawn from once (McKay, Beckman
             and Conover 1979). lo:hi is continuous; a list, or lo:hi:n with its n values, is drawn from likewise.

A key is a path as `--set` takes it, and `a`, `b`, `c` are TOML values.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from math import isfinite
from typing import Any, Final

from experiments.scenario.overrides import parse_path
from experiments.scenario.problems import path_text

NUMBER: Final = r"[+-]?(?:\d[\d_]*)(?:\.\d+)?(?:[eE][+-]?\d+)?"
RANGE: Final = re.compile(rf"\s*({NUMBER})\s*:\s*({NUMBER})\s*(?::\s*(\d+)\s*)?")
MOST_SETTINGS: Final = 1_000_000
NOT_VARIED: Final = "is not varied: --seeds N runs each setting with N seeds"


class BadCampaign(ValueError):
    """A campaign cannot be run as it is asked for."""

    exit_code = 2


@dataclass(frozen=True)
class Varied:
    """A key and its values; or, of a continuous range, `limits` [lo, hi] and no values."""

    key: str
    values: tuple[Any, ...] = ()
    limits: tuple[float, float] | None = None


def parse(text: str) -> Varied:
    """Return what one `--vary` says; BadCampaign for what cannot be read. The loader judges key and values."""
    place, rest = parse_path(text)
    if not place or not rest.startswith("="):
        raise BadCampaign(f"--vary {text}: expected KEY=a,b,c or KEY=lo:hi:n, as in impairments[0].loss_ratio=0:0.5:6")
    key, given = path_text(place), rest[1:].strip()
    if key == "seed":
        raise BadCampaign(f"--vary {text}: seed {NOT_VARIED}")
    if found := RANGE.fullmatch(given):
        return _range(text, key, *found.groups())
    try:
        values = tomllib.loads(f"values = [{given}]")["values"]
    except (tomllib.TOMLDecodeError, RecursionError):
        raise BadCampaign(f"--vary {text}: {given!r} is no list of TOML values; text needs quotes: "
                          f"'{key}=\"a\",\"b\"'; a range is lo:hi:n") from None
    if not values:
        raise BadCampaign(f"--vary {text}: has no value: expected KEY=a,b,c or KEY=lo:hi:n")
    return Varied(key, tuple(values))


def of_values(key: str, values: Iterable[Any]) -> Varied:
    """Return the values of a key as Python gives them; a tuple (lo, hi) of two floats is no range but two values."""
    place, rest = parse_path(key)
    if not place or rest:
        raise BadCampaign(f"vary {key!r}: expected path.to.key, as in impairments[0].loss_ratio")
    if path_text(place) == "seed":
        raise BadCampaign(f"vary {key!r}: seed {NOT_VARIED}")
    found = tuple(values)
    if not found:
        raise BadCampaign(f"vary {key!r}: has no value")
    return Varied(path_text(place), found)


def _range(text: str, key: str, low: str, high: str, count: str | None) -> Varied:
    whole = all(re.fullmatch(r"[+-]?[\d_]+", end) for end in (low, high))
    lo, hi = float(low), float(high)
    if not (isfinite(lo) and isfinite(hi) and lo < hi):
        raise BadCampaign(f"--vary {text}: expected lo < hi")
    if count is None:
        return Varied(key, limits=(lo, hi))
    n = int(count)
    if not 2 <= n <= MOST_SETTINGS:
        raise BadCampaign(f"--vary {text}: expected 2 values or more in lo:hi:n")
    if whole and (int(high) - int(low)) % (n - 1) == 0:
        return Varied(key, tuple(range(int(low), int(high) + 1, (int(high) - int(low)) // (n - 1))))
    return Varied(key, tuple(lo + (hi - lo) * k / (n - 1) if k < n - 1 else hi for k in range(n)))


def grid(varied: Sequence[Varied]) -> list[dict[str, Any]]:
    """Return every combination; one setting without values if nothing is varied."""
    _refuse_twice(varied)
    for one in varied:
        if one.limits is not None:
            raise BadCampaign(f"--vary {one.key}={one.limits[0]:g}:{one.limits[1]:g}: a grid needs the number of "
                              "values: lo:hi:n; or say --sample latin --runs N")
    total = 1
    for one in varied:
        total *= len(one.values)
    if total > MOST_SETTINGS:
        raise BadCampaign(f"{total} settings: at most {MOST_SETTINGS}; --sample latin --runs N takes N of them")
    return [dict(zip([one.key for one in varied], values, strict=True))
            for values in product(*(one.values for one in varied))]


def latin(varied: Sequence[Varied], settings: int, seed: int) -> list[dict[str, Any]]:
    """Return `settings` points of a Latin hypercube over the keys; the same `seed` draws the same ones."""
    from scipy.stats import qmc

    _refuse_twice(varied)
    if not varied:
        raise BadCampaign("--sample latin: nothing is varied: give --vary 'KEY=lo:hi'")
    if not 1 <= settings <= MOST_SETTINGS:
        raise BadCampaign(f"--runs {settings}: expected 1 to {MOST_SETTINGS}")
    drawn = qmc.LatinHypercube(len(varied), rng=seed).random(settings)
    return [{one.key: _at(one, float(share)) for one, share in zip(varied, row, strict=True)} for row in drawn]


def _at(varied: Varied, share: float) -> Any:
    """Return the value at `share` of [0, 1) of the key's range."""
    if varied.limits is not None:
        return varied.limits[0] + share * (varied.limits[1] - varied.limits[0])
    return varied.values[min(int(share * len(varied.values)), len(varied.values) - 1)]


def _refuse_twice(varied: Sequence[Varied]) -> None:
    keys = [one.key for one in varied]
    for key in keys:
        if keys.count(key) > 1:
            raise BadCampaign(f"--vary {key}: is varied twice; give all of its values at once")
