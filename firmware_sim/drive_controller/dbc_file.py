"""Reads a DBC file with cantools; what is wrong with one comes with file, line and remedy. Only this file imports it.

Not covered: what cantools takes although other tools would not.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:                       # a scenario is checked without cantools, which takes as long as all the rest
    from cantools.database import Database, Message

__all__ = ["REMEDY", "DbcError", "Message", "codec_error", "message_with", "read_dbc"]

REMEDY: Final = "correct it there; `python -m cantools dump FILE` shows what a DBC file says"

_SYNTAX: Final = re.compile(r'Invalid syntax at line (?P<line>\d+), column (?P<column>\d+): "(?P<text>.*)"', re.DOTALL)
_VALUES: Final = re.compile(r"VAL_ (?P<message>\d+) (?P<signal>\w+)")
_MESSAGE: Final = re.compile(r"(?:[Tt]he signals? (?P<signal>\w+) .*)?in message (?P<message>\w+)")


class DbcError(ValueError):
    """A DBC file that cannot be used: file, line, what is wrong, remedy."""


def read_dbc(file: Path) -> Database:
    """The messages of a DBC file."""
    from cantools.database import Database, load_file
    from cantools.database.errors import Error, UnsupportedDatabaseFormatError

    try:
        found = load_file(file, database_format="dbc")
    except OSError as error:
        raise DbcError(f"{file}: cannot be read ({error.strerror}); give the path of a DBC file") from None
    except UnsupportedDatabaseFormatError as error:
        raise DbcError(f"{file}: {_complaint(str(error.e_dbc or error), file)}; {REMEDY}") from None
    except (Error, ValueError, KeyError, TypeError, ArithmeticError, LookupError) as error:
        raise DbcError(f"{file}: {_complaint(f'{type(error).__name__}: {error}', file)}; {REMEDY}") from None
    assert isinstance(found, Database)
    return found


def codec_error() -> type[Exception]:
    """What a message of a DBC file raises for values or bytes that do not fit it, beside Python's own errors."""
    from cantools.database.errors import Error

    return Error


def message_with(database: Database, file: Path, name: str, signals: Iterable[str]) -> Message:
    """The message `name`; DbcError unless it has just these signals, all of them always there."""
    known = {message.name: message for message in database.messages}
    if name not in known:
        raise DbcError(f"{file}: no message {name}{_nearest(name, known)}; add it as in the drive.dbc of marconet")
    message = known[name]
    line = _line_of(file.read_text("cp1252", errors="replace"), rf"BO_ +\d+ +{name}\b")
    there = {signal.name for signal in message.signals}
    for signal in signals:
        if signal not in there:
            raise DbcError(f"{file}: line {line}: message {name} has no signal {signal}{_nearest(signal, there)}; "
                           "add it as in the drive.dbc of marconet")
    if more := sorted(there - set(signals)):
        raise DbcError(f"{file}: line {line}: message {name}: nobody here fills the signal {more[0]}; leave it out")
    if message.is_multiplexed():
        raise DbcError(f"{file}: line {line}: message {name} is multiplexed; give each signal a place of its own")
    return message


def _complaint(said: str, file: Path) -> str:
    syntax = _SYNTAX.fullmatch(said)
    if syntax is not None:
        text = " ".join(syntax["text"].replace(">>!<<", " <here> ").split())
        return f"line {syntax['line']}, column {syntax['column']}: not DBC: {text or 'the file is empty'}"
    text = file.read_text("cp1252", errors="replace")
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
    """Number of the first line that begins with `pattern`, 0 if there is none."""
    found = re.compile(f"^{pattern}", re.MULTILINE).search(text, since)
    return text.count("\n", 0, found.start()) + 1 if found else 0


def _nearest(name: str, known: Iterable[str]) -> str:
    near = get_close_matches(name, list(known), 1, cutoff=0.5)
    return f" (the nearest is {near[0]})" if near else ""
