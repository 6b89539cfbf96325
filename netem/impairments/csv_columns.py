"""Columns of numbers from a CSV file with a header, for recorded delays and losses.

A time column is named by its unit, `delay_s`, `_ms`, `_us` or `_ns`, and comes out as int nanoseconds under the name
`delay_ns`, rounded from the decimal digits (no detour through binary fractions). Other columns come out as floats.

Not modelled: quoting beyond the csv module's default, comments, missing values.
"""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterator
from decimal import Decimal, InvalidOperation
from difflib import get_close_matches
from pathlib import Path

NS_PER = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
REPORTED = 10


class RecordingError(ValueError):
    """A file of recorded values cannot be used; the message lists every problem, one a line."""


def read_columns(file: str, times: Collection[str], ratios: Collection[str]) -> dict[str, list[int] | list[float]]:
    """`times` are names without unit (they come out as `<name>_ns`), `ratios` plain names with values in [0, 1]."""
    try:
        with Path(file).open(newline="", encoding="utf-8-sig") as text:
            rows = list(csv.reader(text))
    except (OSError, UnicodeDecodeError, csv.Error) as reason:
        raise RecordingError(f"{file}: cannot be read as CSV: {reason}") from reason
    if not rows:
        raise RecordingError(f"{file}: empty: expected a header and rows")
    header = [name.strip() for name in rows[0]]
    problems = list(_header_problems(file, header, times, ratios))
    if problems:
        raise RecordingError("\n".join(problems))
    columns: dict[str, list[int] | list[float]] = {}
    numbered = [(line, row) for line, row in enumerate(rows[1:], 2) if row]
    for at, name in enumerate(header):
        stem, _, unit = name.rpartition("_")
        per = NS_PER[unit] if stem in times else None
        values: list[float] = []
        for line, row in numbered:
            try:
                values.append(_value(row[at], per))
            except (InvalidOperation, IndexError, ValueError):
                found = row[at].strip() if at < len(row) else "nothing"
                rule = "a number from 0 to 1" if per is None else "a number >= 0"
                problems.append(f"{file}:{line}: {name}={found}: expected {rule}")
        columns[name if per is None else f"{stem}_ns"] = values
    if not numbered:
        problems.append(f"{file}: no rows below the header")
    if problems:
        more = [f"{file}: and {len(problems) - REPORTED} more"] if len(problems) > REPORTED else []
        raise RecordingError("\n".join(problems[:REPORTED] + more))
    return columns


def _value(text: str, ns_per: int | None) -> float:
    number = Decimal(text.strip())
    if not number.is_finite() or number < 0 or (ns_per is None and number > 1):
        raise ValueError
    return float(number) if ns_per is None else int((number * ns_per).to_integral_value())


def _header_problems(file: str, header: list[str], times: Collection[str], ratios: Collection[str]) -> Iterator[str]:
    valid = [f"{name}_{unit}" for name in times for unit in NS_PER] + list(ratios)
    seen: set[str] = set()
    for name in header:
        if name not in valid:
            near = get_close_matches(name, valid, 1)
            remedy = f"nearest: {near[0]}" if near else f"expected of {', '.join(valid)}"
            yield f"{file}:1: column {name!r} is not known, {remedy}"
            continue
        stem = name if name in ratios else name.rpartition("_")[0]
        if stem in seen:
            yield f"{file}:1: column {name!r}: {stem} stands there twice"
        seen.add(stem)
