"""Reads a CSV file as columns of text: finds its separator, its encoding, its header and the requested columns.

    # comment lines above the header are skipped
    seq;time_s;rtt;lost          separator: of comma, tab and semicolon the one that the header has most of
    1;0,1;12,5;0                 a decimal comma is allowed if the separator is not a comma

The text is UTF-8, or UTF-16 with a byte order mark. Columns that are not requested are not read, whatever they hold.

Not modelled: values that span lines, comments below the header, separators other than these three.
"""

from __future__ import annotations

import codecs
import csv
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, Final

from netem.core.nearest import nearest
from netem.wire.instants import NS_PER

SEPARATORS: Final = {",": "comma", "\t": "tab", ";": "semicolon"}
REPORTED: Final = 10
_BLOCK_BYTES: Final = 1 << 30


class RecordingError(ValueError):
    """A file of recorded values cannot be used; the message lists the problems, one a line."""


@dataclass(frozen=True)
class TextColumns:
    """The requested columns of a file.

    `cells` maps the name of each to an Arrow array of text, `headers` to the name that the file has for it.
    """

    file: str
    rows: int
    cells: Mapping[str, Any]
    headers: Mapping[str, str]
    there: str                              # names of all columns of the file, for messages
    _content: bytes                         # the file below the header
    separator: str
    _lines_above: int                       # number of lines down to the header, included

    def line(self, row: int) -> int:
        """Line of the file in which row 0, 1, ... ends."""
        reader = csv.reader(StringIO(self._content.decode(errors="replace"), newline=""), delimiter=self.separator)
        try:
            for found in reader:
                row -= bool(found)
                if row < 0:
                    break
        except csv.Error:
            pass                            # a value exceeds csv's limit: return the line reached so far
        return self._lines_above + reader.line_num


def read_text(file: str, known: Collection[str], columns: Mapping[str, str]) -> TextColumns:
    """Read the columns of `file` whose names are in `known` or that `columns` maps to (known name -> name in the file).

    Raises `RecordingError` if the file cannot be read as CSV, has no rows, or has none of these columns.
    """
    import pyarrow as pa  # late: a scenario without recordings needs no Arrow
    from pyarrow import csv as arrow_csv

    content = _utf8(file)
    header_bytes, content, lines_above = _split(content)
    header_text = header_bytes.decode(errors="replace")
    if not header_text:
        raise RecordingError(f"{file}: empty: expected a header and rows")
    separator = max(SEPARATORS, key=header_text.count)
    try:
        header = [name.strip() for name in next(csv.reader([header_text], delimiter=separator), [])]
    except csv.Error as reason:
        raise RecordingError(f"{file}:{lines_above}: cannot be read as the header of a CSV file: {reason}") from reason
    places = _places(file, lines_above, header, separator, known, columns)
    names = [f"c{place}" for place in range(len(header))]
    wanted = [names[place] for place in places.values()]
    try:
        table = arrow_csv.read_csv(
            BytesIO(content or b"\n"),
            read_options=arrow_csv.ReadOptions(use_threads=False, column_names=names,
                                               block_size=min(max(len(content), 1 << 16), _BLOCK_BYTES)),
            parse_options=arrow_csv.ParseOptions(delimiter=separator),
            convert_options=arrow_csv.ConvertOptions(include_columns=wanted, strings_can_be_null=False,
                                                     column_types=dict.fromkeys(wanted, pa.string())))
    except (pa.ArrowException, OSError) as reason:
        report(_uneven_rows(file, content, header, separator, lines_above))
        raise RecordingError(f"{file}: cannot be read as CSV: {printable(str(reason))[:200]}") from reason
    text = TextColumns(file, table.num_rows, {own: table[names[place]] for own, place in places.items()},
                       {own: header[place] for own, place in places.items()}, _shown(header), content, separator,
                       lines_above)
    if not table.num_rows:
        raise RecordingError(f"{file}: no rows below the header")
    return text


def report(problems: Iterable[str]) -> None:
    """Raise a RecordingError that lists the problems, if there are any."""
    lines = list(problems)
    if lines:
        raise RecordingError("\n".join(lines))


def first_of(rows: Sequence[tuple[int, str]], text: TextColumns, describe: Callable[[str], str]) -> Iterator[str]:
    """Yield a message for each of the first `REPORTED` (row, value), and one with the number of the others."""
    for row, value in rows[:REPORTED]:
        yield f"{text.file}:{text.line(row)}: {describe(printable(value)[:40] or 'nothing')}"
    if len(rows) > REPORTED:
        yield f"{text.file}: and {len(rows) - REPORTED} more"


def _uneven_rows(file: str, content: bytes, header: list[str], separator: str, lines_above: int) -> list[str]:
    """Read the rows line by line; return a message for each of the first with more or fewer values than the header."""
    problems: list[str] = []
    reader = csv.reader(StringIO(content.decode(errors="replace"), newline=""), delimiter=separator)
    try:
        for row in reader:
            if row and len(row) != len(header) and len(problems) < REPORTED:
                problems.append(f"{file}:{lines_above + reader.line_num}: {len(row)} value{'s'[:len(row) != 1]} in the "
                                f"row: expected {len(header)}, as the header has ({SEPARATORS[separator]}-separated)")
    except csv.Error:
        pass                                # a value exceeds csv's limit: report the rows reached so far
    return problems


def printable(text: str) -> str:
    """Return `text` for one line of a message: runs of blanks as one space, unprintable characters as `?`."""
    return "".join(letter if letter.isprintable() else "?" for letter in " ".join(text.split()))


def _utf8(file: str) -> bytes:
    try:
        content = Path(file).read_bytes()
        if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            content = content.decode("utf-16").encode()
    except (OSError, ValueError) as reason:
        raise RecordingError(f"{file}: cannot be read as CSV: {reason}") from reason
    return content.removeprefix(codecs.BOM_UTF8)


def _split(content: bytes) -> tuple[bytes, bytes, int]:
    """Return (header, content below it, number of lines down to it), skipping empty lines and comments above it."""
    lines, start = 0, 0
    while start < len(content):
        ends = [end for mark in (b"\n", b"\r") if (end := content.find(mark, start)) >= 0]
        end = min(ends, default=len(content))
        line = content[start:end].strip()
        start = end + (2 if content[end:end + 2] == b"\r\n" else 1)
        lines += 1
        if line and not line.startswith(b"#"):
            return line, content[start:], lines
    return b"", b"", lines


def _places(file: str, line: int, header: list[str], separator: str, known: Collection[str],
            columns: Mapping[str, str]) -> dict[str, int]:
    """Map each known name to its index in the header; an entry of `columns` overrules a header that fits by itself."""
    problems: list[str] = []
    places: dict[str, int] = {}
    for own, theirs in columns.items():
        if own not in known:
            problems.append(f"columns={own}: no column of this kind; {_nearest(own, known)}")
        elif theirs not in header:
            problems.append(f"{file}:{line}: no column {theirs!r}, as columns.{own} says; {_nearest(theirs, header)}")
        else:
            places[own] = header.index(theirs)
    given = {_stem(own) for own in columns}
    by_name = {name: name for name in known} | {name.lower(): name for name in known}
    for place, theirs in enumerate(header):
        own = by_name.get(theirs) or by_name.get(theirs.lower(), "")
        if not own or _stem(own) in given or place in places.values():
            continue
        twice = [other for other in places if _stem(other) == _stem(own)]
        if twice:
            problems.append(f"{file}:{line}: column {theirs!r}: {_stem(own)} stands there twice, also as "
                            f"{header[places[twice[0]]]!r}; name the one to use, as in columns = {{ {own} = "
                            f'"{theirs}" }}')
        places.setdefault(own, place)
    report(problems)
    if not places:
        raise RecordingError(
            f"{file}:{line}: none of its columns is known ({_shown(header)}; separated by {SEPARATORS[separator]}): "
            f"expected one of {_shown(known)}; map other names as in columns = {{ {next(iter(known))} = "
            '"NAME" }')
    return places


def _stem(name: str) -> str:
    stem, _, unit = name.rpartition("_")
    return stem if unit in NS_PER else name


def _nearest(name: str, names: Collection[str]) -> str:
    near = nearest(name, names, 0.6)
    return f"nearest: {printable(near)}" if near else f"there are {_shown(names)}"


def _shown(names: Collection[str]) -> str:
    text = ", ".join(map(printable, names))
    return text if len(text) <= 200 else text[:197] + "..."
