"""Reads columns of numbers, recorded delays and losses, from a CSV file with a header.

    time_s, delay_ms      the name ends in the unit, _s, _ms, _us or _ns; read as int nanoseconds, rounded half to even
                          from the decimal digits, not through a binary fraction
    lost, received        0 or 1, false or true; read as whether the copy was lost
    probability           a number from 0 to 1

The delay of a lost copy is not read, whatever the cell holds.

Invariant: `all_at_once` and `one_ns`, the two conversions of a time, give the same nanoseconds.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal
from typing import Any, Final

import numpy as np

from netem.impairments.csv_text import RecordingError, TextColumns, first_of, read_text, report
from netem.wire.instants import NEVER_NS, NS_PER

__all__ = ["Columns", "RecordingError", "read_columns"]

FLAGS: Final = ("lost", "received")
_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_TRUE: Final = frozenset({"1", "true"})
_FALSE: Final = frozenset({"0", "false"})

Integers = np.ndarray[tuple[int], np.dtype[np.int64]]
Floats = np.ndarray[tuple[int], np.dtype[np.float64]]
Flags = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True)
class Columns:
    """The requested columns that the file has; each has `rows` entries."""

    rows: int
    times_ns: Mapping[str, Integers]        # by name without unit: "time", "delay"
    lost: Flags | None
    ratios: Mapping[str, Floats]
    text: TextColumns

    def line(self, row: int) -> int:
        """Line of the file in which row 0, 1, ... ends."""
        return self.text.line(row)


def read_columns(file: str, *, times: Collection[str], ratios: Collection[str] = (), flags: bool = False,
                 columns: Mapping[str, str] | None = None) -> Columns:
    """Read the requested columns of `file`; raises `RecordingError`, which lists every problem.

    `times` are names without unit, `ratios` names of columns with numbers from 0 to 1; `flags` also reads `lost` or
    `received`. `columns` maps a name with its unit to the name that the file has instead: {"delay_ms": "rtt"}.
    """
    known = [f"{stem}_{unit}" for stem in times for unit in NS_PER] + list(ratios) + (list(FLAGS) if flags else [])
    text = read_text(file, known, columns or {})
    cells = {own: _plain(cells, text) for own, cells in text.cells.items()}
    problems: list[str] = []
    lost = _lost(text, cells, problems)
    found_ns: dict[str, Integers] = {}
    for stem in times:
        for own in (f"{stem}_{unit}" for unit in NS_PER if f"{stem}_{unit}" in cells):
            skipped = lost if stem == "delay" else None
            found_ns[stem] = _times_ns(text, own, cells[own], skipped, problems, signed=stem == "time")
    found = {own: _ratios(text, own, cells[own], problems) for own in ratios if own in cells}
    report(problems)
    return Columns(text.rows, found_ns, lost, found, text)


def _plain(cells: Any, text: TextColumns) -> Any:
    """Return the text of the cells without surrounding blanks and with a decimal point for a decimal comma."""
    import pyarrow.compute as pc

    trimmed = pc.utf8_trim_whitespace(cells)
    return trimmed if text.separator == "," else pc.replace_substring(trimmed, ",", ".")


def _lost(text: TextColumns, cells: Mapping[str, Any], problems: list[str]) -> Flags | None:
    there = [own for own in FLAGS if own in cells]
    if len(there) == 2:
        problems.append(f"{text.file}: columns {text.headers['lost']!r} and {text.headers['received']!r} both tell "
                        "which copies are lost; remove one")
    if not there:
        return None
    own = there[0]
    coded = cells[own].combine_chunks().dictionary_encode()
    values: list[str] = coded.dictionary.to_pylist()
    codes = np.asarray(coded.indices)
    meant = [_flag(value) for value in values]
    if None in meant:
        wrong = np.flatnonzero(np.array([flag is None for flag in meant])[codes])
        problems += _refused(text, own, [(int(row), values[codes[row]]) for row in wrong], "0 or 1, false or true")
    lost: Flags = np.array([flag is (own == "lost") for flag in meant], dtype=np.bool_)[codes]
    return lost


def _flag(value: str) -> bool | None:
    plain = value.lower()
    if plain in _TRUE or plain in _FALSE:
        return plain in _TRUE
    return bool(Decimal(plain)) if _NUMBER.fullmatch(plain) and len(plain) < 20 and Decimal(plain) in (0, 1) else None


def _times_ns(text: TextColumns, own: str, cells: Any, skipped: Flags | None, problems: list[str], *,
              signed: bool) -> Integers:
    """Convert a column to nanoseconds; rows that `skipped` marks become 0."""
    import pyarrow as pa
    import pyarrow.compute as pc

    unit = own.rpartition("_")[2]
    if skipped is not None:
        cells = pc.if_else(pa.array(skipped), "0", cells)
    try:
        values_ns = all_at_once(cells, unit)
    except pa.ArrowInvalid:
        return _one_by_one(text, own, cells.to_pylist(), problems, signed)
    if signed or values_ns.min() >= 0:
        return values_ns
    return _one_by_one(text, own, cells.to_pylist(), problems, signed)


def all_at_once(cells: Any, unit: str) -> Integers:
    """Convert a column of decimal text to nanoseconds.

    Raises ArrowInvalid if a value is no number, reaches `LIMIT_NS`, or has more than 18 decimals.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    digits = len(str(NS_PER[unit])) - 1
    exact = pc.cast(cells, pa.decimal128(38, 18))
    rounded = pc.cast(pc.round(exact, digits, "half_to_even"), pa.decimal128(38, digits)).combine_chunks()
    words = np.frombuffer(rounded.buffers()[1], "<i8")[2 * rounded.offset:].reshape(-1, 2)[:len(rounded)]
    if (abs(words[:, 0]) >= NEVER_NS).any() or (words[:, 0] >> 63 != words[:, 1]).any():
        raise pa.ArrowInvalid("beyond the limit")
    return words[:, 0].copy()


def one_ns(value: str, unit: str) -> int | None:
    """Convert decimal text to nanoseconds; None if it is no number or reaches `LIMIT_NS`."""
    if not _NUMBER.fullmatch(value):
        return None
    try:
        number = Decimal(value)
        if abs(number) >= NEVER_NS // NS_PER[unit]:
            return None
        return int((number * NS_PER[unit]).to_integral_value(ROUND_HALF_EVEN))
    except ArithmeticError:
        return None


def _one_by_one(text: TextColumns, own: str, cells: Sequence[str], problems: list[str], signed: bool) -> Integers:
    unit = own.rpartition("_")[2]
    values_ns = [one_ns(value, unit) for value in cells]

    wrong = [(row, cells[row]) for row, value_ns in enumerate(values_ns)
             if value_ns is None or (value_ns < 0 and not signed)]
    problems += _refused(text, own, wrong, "a number" if signed else
                         "a number >= 0 (only a copy that a column `lost` gives as 1 needs none)")
    return np.array([value_ns or 0 for value_ns in values_ns], dtype=np.int64)


def _ratios(text: TextColumns, own: str, cells: Any, problems: list[str]) -> Floats:
    values = [float(value) if _NUMBER.fullmatch(value) else -1.0 for value in cells.to_pylist()]
    wrong = [(row, cells[row].as_py()) for row, value in enumerate(values) if not 0 <= value <= 1]
    problems += _refused(text, own, wrong, "a number from 0 to 1")
    return np.array(values)


def _refused(text: TextColumns, own: str, wrong: Sequence[tuple[int, str]], rule: str) -> Iterator[str]:
    return first_of(wrong, text, lambda value: f"{text.headers[own]}={value}: expected {rule}")
