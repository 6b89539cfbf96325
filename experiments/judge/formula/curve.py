"""Piecewise linear functions of time on [0, end], with jumps, and the operations of a formula on them, exact and whole.

On [t[k], t[k+1]) the function is linear from `first[k]` towards `last[k]`, its limit at t[k+1] from below; it is
continuous from the right. At `end` its value is that limit. A sampled signal has constant pieces, an age rising ones.

Every result has a breakpoint wherever its slope or value changes, also where two functions cross, so no extreme is
missed between samples. Times are float64 ns: instants of a run are whole numbers below 2^53 and exact, crossings are
rounded. No operation has a loop over pieces; the largest of n pieces over windows takes O(n log n).

Source: A. Donzé, T. Ferrère, O. Maler 2013 (robustness of piecewise linear signals). Differs from it: jumps, and
windows by a sparse table of extremes instead of a queue (D. Lemire 2006), which NumPy cannot express without a loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


class NotThatLong(Exception):
    """A window reaches beyond the end; `short_ns` is by how much."""

    def __init__(self, short_ns: float) -> None:
        self.short_ns = short_ns
        super().__init__(f"{short_ns} ns beyond the end")


@dataclass(frozen=True)
class Curve:
    """`t` has the n + 1 breakpoints [ns] from 0 on, `first` and `last` the values at both ends of the n pieces."""

    t: Floats
    first: Floats
    last: Floats

    @property
    def end(self) -> float:
        return float(self.t[-1])

    def __neg__(self) -> Curve:
        return Curve(self.t, -self.first, -self.last)


def constant(value: float, end: float) -> Curve:
    values = np.array([value])
    return Curve(np.array([0.0, end]), values, values)


def steps(at: NDArray[np.int64], values: Floats, end: float) -> Curve:
    """Return the function that has `values[k]` from `at[k]` on, and values[0] before; of equal instants the last."""
    kept = np.r_[at[1:] != at[:-1], True] & (at < end)
    at, values = at[kept], values[kept]
    if not at.size:
        return constant(float("nan"), end)
    t = np.r_[0.0, at[1:].astype(np.float64), end] if at[0] >= 0 else np.r_[at.astype(np.float64), end]
    return _compact(Curve(t, values, values))


def restricted(curve: Curve, start: float, end: float) -> Curve:
    """Return the part on [start, end]; its times are not changed."""
    k, m = _piece(curve, np.array([start]))[0], int(np.searchsorted(curve.t, end, side="left"))
    m = max(m, k + 1)
    t = np.r_[start, curve.t[k + 1:m], end]
    pieces = np.arange(k, m)
    return Curve(t, _at(curve, t[:-1], pieces), _at(curve, t[1:], pieces))


def together(one: Curve, other: Curve) -> tuple[Curve, Curve]:
    """Return both functions on their common breakpoints, up to the earlier end."""
    if one.t is other.t or np.array_equal(one.t, other.t):
        return one, other
    end = min(one.end, other.end)
    t = _merged(one.t, other.t)
    t = np.r_[t[t < end], end] if end > 0 else np.zeros(2)
    return _on(one, t), _on(other, t)


def plus(one: Curve, other: Curve) -> Curve:
    one, other = together(one, other)
    return Curve(one.t, one.first + other.first, one.last + other.last)


def times(one: Curve, other: Curve) -> Curve:
    """Return the product; on each piece one of both is constant, as the caller has checked."""
    one, other = together(one, other)
    return Curve(one.t, one.first * other.first, one.last * other.last)


def over(one: Curve, other: Curve) -> Curve:
    """Return the quotient by a function with constant pieces; nan or inf where that is 0."""
    one, other = together(one, other)
    with np.errstate(divide="ignore", invalid="ignore"):
        return Curve(one.t, one.first / other.first, one.last / other.last)


def absolute(curve: Curve) -> Curve:
    curve = split_at_zero(curve)
    return Curve(curve.t, np.abs(curve.first), np.abs(curve.last))


def smaller(one: Curve, other: Curve) -> Curve:
    """Return the smaller of both at each instant."""
    one, other = split_at_crossings(one, other)
    return _compact(Curve(one.t, np.minimum(one.first, other.first), np.minimum(one.last, other.last)))


def larger(one: Curve, other: Curve) -> Curve:
    return -smaller(-one, -other)


def largest(curves: Sequence[Curve]) -> Curve:
    """Return the largest at each instant, by pairs, so that n curves of m pieces take O(n m log(n m))."""
    found = list(curves)
    while len(found) > 1:
        found = [larger(*found[k:k + 2]) if k + 1 < len(found) else found[k] for k in range(0, len(found), 2)]
    return found[0]


def split_at_zero(curve: Curve) -> Curve:
    """Return the same function with a breakpoint at each zero inside a piece."""
    return split_at_crossings(curve, constant(0.0, curve.end))[0]


def split_at_crossings(one: Curve, other: Curve) -> tuple[Curve, Curve]:
    """Return both functions on common breakpoints, also where they cross."""
    return _crossing(*together(one, other))


def sup(curve: Curve, from_ns: float, to_ns: float | None) -> Curve:
    """Return the supremum over [t + from_ns, t + to_ns], as a function of t; None: up to the end.

    The result ends where the window reaches the end. A piece has its extremes at its ends; so the supremum is that of
    both edges of the window and of the breakpoints in it. Raises NotThatLong.
    """
    span = curve.end - (from_ns if to_ns is None else to_ns)
    if span < 0:
        raise NotThatLong(-span)
    left = _shifted(curve, from_ns, span)
    peaks = np.r_[np.maximum(curve.last[:-1], curve.first[1:]), curve.last[-1]]         # at t[1:]
    opens = curve.t[1:] - from_ns                       # from then on a breakpoint is no longer inside
    if to_ns is None:
        inside = np.maximum.accumulate(peaks[::-1])[::-1]
        grid = _grid(opens, opens[:0], span)
        k = np.searchsorted(opens, grid[:-1], side="right")
        values = np.where(k < peaks.size, inside[np.minimum(k, peaks.size - 1)], -np.inf)
        return larger(left, Curve(grid, values, values))
    closes = curve.t[1:] - to_ns                        # from then on it is inside
    grid = _grid(opens, closes, span)
    low = np.searchsorted(opens, grid[:-1], side="right")
    high = np.searchsorted(closes, grid[:-1], side="right")
    values = _largest_between(peaks, low, high)
    right = _shifted(curve, to_ns, span)
    return larger(larger(left, right), Curve(grid, values, values))


def inf(curve: Curve, from_ns: float, to_ns: float | None) -> Curve:
    """Return the infimum over [t + from_ns, t + to_ns]; see `sup`."""
    return -sup(-curve, from_ns, to_ns)


def until(hold: Curve, reach: Curve, from_ns: float, to_ns: float | None) -> Curve:
    """Return sup over t' in [t + from_ns, t + to_ns] of min(reach(t'), inf of hold over [t, t') and [t, t + from_ns]).

    Source: Donzé, Ferrère, Maler 2013, lemma on the bounded until: a bounded one is the unbounded one and an
    eventually. On a piece of both, from x = hold, y = reach, z = min(x, y), and u, the value at the end of the piece:

        max(y(t), min(x(t), max(z(t), z_end)), min(x(t), x_end, u))
    """
    x, y = split_at_crossings(hold, reach)
    z_last = np.minimum(x.last, y.last)
    best = np.maximum(np.minimum(x.first, y.first), z_last)
    within = np.maximum(y.first, np.minimum(x.first, best))                 # at the start of each piece
    through = np.minimum(x.first, x.last)
    after = np.r_[_values_backwards(within, through)[1:], -np.inf]          # u of each piece
    z = Curve(x.t, np.minimum(x.first, y.first), np.minimum(x.last, y.last))
    inner = larger(y, smaller(x, larger(z, Curve(x.t, z_last, z_last))))
    found = larger(inner, smaller(smaller(x, Curve(x.t, x.last, x.last)), Curve(x.t, after, after)))
    if to_ns is not None:
        soon = sup(y, 0.0, to_ns - from_ns)
        found = smaller(found, soon)
    if from_ns:
        if found.end < from_ns:
            raise NotThatLong(from_ns - found.end)
        found = smaller(_shifted(found, from_ns, found.end - from_ns), inf(x, 0.0, from_ns))
    return found


def value(curve: Curve, at: float, below: bool = False) -> float:
    """Return the value at an instant, or with `below` its limit from below."""
    k = int(np.searchsorted(curve.t, at, side="left")) - 1 if below else int(_piece(curve, np.array([at]))[0])
    k = min(max(k, 0), curve.first.size - 1)
    return float(_at(curve, np.array([at]), np.array([k]))[0])


@dataclass(frozen=True)
class Points:
    """Instants in the order of time, some of them limits from below, with the values there."""

    at: Floats
    below: NDArray[np.bool_]
    values: Floats


def extremes(curve: Curve, start: float, end: float, below: bool) -> Points:
    """Return the instants of [start, end] at which an extreme may be: its edges and both sides of each breakpoint.

    With `below` the window is that of a limit from below: it ends just before `end`, and begins just before `start`.
    """
    edges = np.array([start, end])
    low, high = np.searchsorted(curve.t, edges, side="left" if below else "right").tolist()
    inner = np.arange(max(low, 1), min(high, curve.t.size - 1))
    at = np.r_[start, np.repeat(curve.t[inner], 2), end]
    from_below = np.r_[below, np.tile([True, False], inner.size), below]
    sides = np.ravel(np.column_stack([curve.last[inner - 1], curve.first[inner]]))
    return Points(at, from_below, np.r_[value(curve, start, below), sides, value(curve, end, below)])


def _piece(curve: Curve, at: Floats) -> Indices:
    """Return the index of the piece [t[k], t[k+1]) of each instant; the last one for the end."""
    return np.clip(np.searchsorted(curve.t, at, side="right") - 1, 0, curve.first.size - 1)


def _at(curve: Curve, at: Floats, piece: Indices) -> Floats:
    """Return the values of the given pieces at instants within them, exact at both ends."""
    found = curve.first[piece]
    sloping = np.flatnonzero(curve.last[piece] != found)
    if not sloping.size:
        return found
    at, piece, first = at[sloping], piece[sloping], found[sloping]
    start, end, last = curve.t[piece], curve.t[piece + 1], curve.last[piece]
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = first + (last - first) * ((at - start) / (end - start))
    found[sloping] = np.where(at <= start, first, np.where(at >= end, last, inside))
    return found


def _on(curve: Curve, t: Floats) -> Curve:
    """Return the same function with the breakpoints `t`, which hold all of its own below t[-1]."""
    piece = _piece(curve, t[:-1])
    return Curve(t, _at(curve, t[:-1], piece), _at(curve, t[1:], piece))


def _crossing(one: Curve, other: Curve) -> tuple[Curve, Curve]:
    """Return both, on common breakpoints, with a further one wherever they cross inside a piece."""
    with np.errstate(invalid="ignore", over="ignore"):
        before, after = one.first - other.first, one.last - other.last
        crosses = np.flatnonzero((before < 0) & (after > 0) | (before > 0) & (after < 0))
    if not crosses.size:
        return one, other
    share = before[crosses] / (before[crosses] - after[crosses])
    at = one.t[crosses] + share * (one.t[crosses + 1] - one.t[crosses])
    kept = (at > one.t[crosses]) & (at < one.t[crosses + 1])
    crosses, at, share = crosses[kept], at[kept], share[kept]
    there = one.first[crosses] + share * (one.last[crosses] - one.first[crosses])       # the value of both
    t = np.insert(one.t, crosses + 1, at)

    def split(curve: Curve) -> Curve:
        return Curve(t, np.insert(curve.first, crosses + 1, there), np.insert(curve.last, crosses, there))

    return split(one), split(other)


def _shifted(curve: Curve, by: float, span: float) -> Curve:
    """Return f(t + by) on [0, span]."""
    moved = Curve(curve.t - by, curve.first, curve.last) if by else curve
    return restricted(moved, 0.0, span)


def _merged(one: Floats, other: Floats) -> Floats:
    """Return the instants of both, sorted, each once; stable sorting merges two sorted arrays in linear time."""
    both = np.concatenate([one, other])
    both.sort(kind="stable")
    return both[np.r_[True, both[1:] != both[:-1]]]


def _grid(one: Floats, other: Floats, span: float) -> Floats:
    inner = _merged(one, other)
    found: Floats = np.r_[0.0, inner[(inner > 0) & (inner < span)], span]
    return found


def _largest_between(values: Floats, low: Indices, high: Indices) -> Floats:
    """Return the largest of values[low[k]:high[k]] for each k, -inf where that is empty: a sparse table by levels."""
    found = np.full(low.size, -np.inf)
    width = np.maximum(high - low, 0)
    level_of = np.frexp(width.astype(np.float64))[1] - 1            # floor(log2(width))
    table, size = values, 1
    for level in range(int(level_of.max(initial=-1)) + 1):
        asked = np.flatnonzero((level_of == level) & (width > 0))
        found[asked] = np.maximum(table[low[asked]], table[high[asked] - size])
        if table.size <= size:
            break
        table, size = np.maximum(table[:-size], table[size:]), 2 * size
    return found


def _values_backwards(within: Floats, through: Floats) -> Floats:
    """Return u[k] = max(within[k], min(through[k], u[k+1])) with u[n] = -inf.

    x -> max(c, min(m, x)) composed with another such clamp is a clamp again: a suffix scan by doubling.
    """
    c, m = within.copy(), through.copy()
    step = 1
    while step < c.size:
        c[:-step] = np.maximum(c[:-step], np.minimum(m[:-step], c[step:]))
        m[:-step] = np.minimum(m[:-step], m[step:])
        step *= 2
    return c


def _compact(curve: Curve) -> Curve:
    """Return the same function without breakpoints between constant pieces of the same value."""
    flat = curve.first == curve.last
    kept = np.r_[True, ~(flat[1:] & flat[:-1] & (curve.first[1:] == curve.first[:-1]))]
    if kept.all():
        return curve
    return Curve(np.r_[curve.t[:-1][kept], curve.t[-1]], curve.first[kept], curve.last[np.r_[kept[1:], True]])
