"""Reads a DBC file with cantools, which only this file imports; an error names file, line and remedy.

The file of a vehicle has messages that marconet never uses, some of them not valid DBC. A message that cannot be parsed
is left out with the reason, and so is each line that refers to it. A message whose signals overlap or do not fit is
kept; `usable_message` refuses it. Files are UTF-8, with or without a byte order mark, or Windows-1252.

Not covered: files that cantools accepts and other tools do not.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from netem.core.nearest import nearest

if TYPE_CHECKING:
    from cantools.database import Database
    from cantools.database import Message as Message  # others annotate with it

__all__ = ["LAYOUT_REMEDY", "REMEDY", "DbcError", "DbcFile", "Message", "cantools_error", "load_library", "read_dbc"]

REMEDY: Final = "correct it there"
LAYOUT_REMEDY: Final = f"{REMEDY}; `python -m cantools dump --no-strict FILE` shows the layout"

_SYNTAX: Final = re.compile(r'Invalid syntax at line (?P<line>\d+), column (?P<column>\d+): "(?P<text>.*)"', re.DOTALL)
_VALUES: Final = re.compile(r"VAL_ (?P<message>\d+) (?P<signal>\w+)")
_MESSAGE: Final = re.compile(r"(?:[Tt]he signals? (?P<signal>\w+) .*)?in message (?P<message>\w+)")
_BLOCK: Final = re.compile(r"^BO_ +(?P<id>\d+) +(?P<name>[^\s:]+) *:.*(?:\n[ \t]+SG_ .*|\n[ \t]*(?=\n[ \t]+SG_ ))*",
                           re.MULTILINE)
_REFERENCE: Final = (r'^(?:CM_ (?:BO_|SG_)|BA_ "[^"]*" (?:BO_|SG_)|VAL_|SIG_VALTYPE_|SG_MUL_VAL_|SIG_GROUP_|BO_TX_BU_)'
                     r' +{id}\b(?:[^";]|"[^"]*")*;')


def load_library() -> None:
    """Import cantools before processes are forked, which would otherwise each import it with their first file."""
    import cantools.database  # noqa: F401  # late everywhere: a scenario without DBC files needs none


def cantools_error() -> type[Exception]:
    """The exception that cantools raises for a layout or for values that it cannot use."""
    from cantools.database.errors import Error

    return Error


def _failures() -> tuple[type[Exception], ...]:
    return cantools_error(), ValueError, KeyError, TypeError, ArithmeticError, LookupError


class DbcError(ValueError):
    """A DBC file cannot be used; the message has file, line, reason and remedy."""


@dataclass(frozen=True)
class DbcFile:
    """The messages of a DBC file. `left_out` maps the name of each message that cannot be parsed to the reason."""

    file: Path
    text: str
    database: Database
    left_out: Mapping[str, str] = field(default_factory=dict)

    def message_with(self, name: str, signals: Iterable[str]) -> Message:
        """Return the usable message `name`; raises DbcError unless it has exactly these signals, not multiplexed."""
        message = self.usable_message(name)
        line = self.lines_of(name)[0]
        there = {signal.name for signal in message.signals}
        for signal in signals:
            if signal not in there:
                raise DbcError(f"{self.file}: line {line}: message {name} has no signal {signal}"
                               f"{_nearest(signal, there)}; add it as in the drive.dbc of marconet")
        if more := sorted(there - set(signals)):
            raise DbcError(f"{self.file}: line {line}: message {name}: marconet's drive does not fill the signal "
                           f"{more[0]}; leave it out")
        if message.is_multiplexed():
            raise DbcError(f"{self.file}: line {line}: message {name} is multiplexed; give each signal a place of its "
                           "own")
        return message

    def usable_message(self, name: str) -> Message:
        """Return the message `name`; raises DbcError if it is missing or defined twice, or its layout is wrong."""
        if name in self.left_out:
            raise DbcError(f"{self.file}: {self.left_out[name]}; {REMEDY}")
        known = {message.name: message for message in self.database.messages}
        if name not in known:
            raise DbcError(f"{self.file}: no message {name}{_nearest(name, known)}; add it as in the drive.dbc of "
                           "marconet")
        message, lines = known[name], self.lines_of(name)
        if len(lines) > 1:
            raise DbcError(f"{self.file}: message {name} stands there twice, lines {', '.join(map(str, lines))}; leave "
                           "one")
        for other in self.database.messages:
            if other.name != name and (other.frame_id, other.is_extended_frame) == (
                    message.frame_id, message.is_extended_frame):
                raise DbcError(f"{self.file}: messages {name} and {other.name} have the same identifier "
                               f"{message.frame_id:#x}, lines {lines[0]}, {self.lines_of(other.name)[0]}; give each "
                               "its own")
        try:
            message.refresh(strict=True)
        except _failures() as error:
            raise DbcError(f"{self.file}: {_complaint(str(error), self.text)}; {LAYOUT_REMEDY}") from None
        return message

    def lines_of(self, name: str) -> list[int]:
        """Numbers of the lines at which the file defines the message `name`."""
        return [_line_at(self.text, found.start()) for found in _BLOCK.finditer(self.text) if found["name"] == name]


def read_dbc(file: Path) -> DbcFile:
    """Read a DBC file; raises DbcError if it cannot be read, or has an error outside its messages."""
    text = _text_of(file)
    if not text.strip():
        raise DbcError(f"{file}: the file is empty; expected a DBC file")
    try:
        return DbcFile(file, text, _parsed(text))
    except _failures() as error:
        complaint, left_out = _complaint(_said(error), text), dict(_odd_messages(text))
    try:
        database = _parsed(_without(text, left_out)) if left_out else None
    except _failures() as error:
        complaint, database = _complaint(_said(error), text), None
    if database is None:
        raise DbcError(f"{file}: {complaint}; {REMEDY}")
    return DbcFile(file, text, database, left_out)


def _text_of(file: Path) -> str:
    try:
        data = file.read_bytes()
    except OSError as error:
        raise DbcError(f"{file}: cannot be read ({error.strerror}); give the path of a DBC file") from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return text.replace("\r\n", "\n")


def _parsed(text: str) -> Database:
    from cantools.database import Database, load_string

    found = load_string(text, database_format="dbc", strict=False)
    assert isinstance(found, Database)
    return found


def _odd_messages(text: str) -> Iterator[tuple[str, str]]:
    """Yield (name, reason) for each message that cannot be parsed by itself."""
    for block in _BLOCK.finditer(text):
        try:
            _parsed(f'VERSION ""\n{block[0]}\n')
        except _failures() as error:
            before = text.count("\n", 0, block.start()) - 1         # the line of VERSION is not in the file
            yield block["name"], _complaint(_said(error), text, before)


def _without(text: str, names: Iterable[str]) -> str:
    """Replace the messages `names`, and statements that refer to them, by empty lines."""
    unwanted = [block for block in _BLOCK.finditer(text) if block["name"] in set(names)]
    for block in reversed(unwanted):
        text = text[:block.start()] + "\n" * block[0].count("\n") + text[block.end():]
    for block in unwanted:
        statement = re.compile(_REFERENCE.format(id=block["id"]), re.MULTILINE)
        text = statement.sub(lambda found: "\n" * found[0].count("\n"), text)
    return text


def _said(error: BaseException) -> str:
    from cantools.database.errors import Error, UnsupportedDatabaseFormatError

    if isinstance(error, UnsupportedDatabaseFormatError):
        return str(error.e_dbc or error)
    return f"{type(error).__name__}: {error}" if not isinstance(error, Error) else str(error)


def _complaint(said: str, text: str, lines_before: int = 0) -> str:
    """Return an error of cantools with the line of `text` that it is about.

    `lines_before` is the number of lines of the file before the text that cantools has parsed.
    """
    syntax = _SYNTAX.fullmatch(said)
    if syntax is not None:
        words = " ".join(syntax["text"].replace(">>!<<", " <here> ").split())
        return f"line {int(syntax['line']) + lines_before}, column {syntax['column']}: not DBC: {words}"
    line = 0
    if (place := _MESSAGE.search(said)) is not None:
        line = _line_of(text, rf"BO_ +\d+ +{place['message']}\b")
        start = sum(map(len, text.splitlines(keepends=True)[:line]))
        if line and place["signal"]:
            line = _line_of(text, rf" *SG_ +{place['signal']}\b", start) or line
    elif (place := _VALUES.search(said)) is not None:
        line = _line_of(text, rf"VAL_ +{place['message']} +{place['signal']}\b")
    said = " ".join(said.split()).rstrip(".")
    return f"line {line}: {said}" if line else said


def _line_of(text: str, pattern: str, since: int = 0) -> int:
    """Number of the first line that matches `pattern` at its beginning, 0 if there is none."""
    found = re.compile(f"^{pattern}", re.MULTILINE).search(text, since)
    return _line_at(text, found.start()) if found else 0


def _line_at(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1


def _nearest(name: str, known: Iterable[str]) -> str:
    near = nearest(name, known)
    return f" (the nearest is {near})" if near else ""
