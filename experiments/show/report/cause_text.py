"""Splits the text of a cause, as a monitor writes it, into lines with the frames of each.

    a saw it last at 3 s; since 2 s radio: a -> b: frames 4, 5 and 9 more lost (impairments[0] bernoulli_loss)

becomes two lines: "a saw it last at 3 s" without frames, and "radio: a -> b: 11 frames lost (impairments[0]
bernoulli_loss)" with the frames 4, 5 "and 9 more". Words that have none of these forms stay one line as they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

FRAMES = re.compile(r"\bframes? (?P<numbers>\d+(?:, \d+)*)(?: and (?P<more>\d+) more)? "
                    r"(?P<fate>.+?)(?=, frames? \d|, [^,:]+: [^,:]+ -> |, slowest |$)")
LINK = re.compile(r"(?P<medium>[\w-]+): (?P<sender>[\w-]+) -> (?P<receiver>[\w-]+):?$")
SINCE = re.compile(r"since (?P<instant>\S+ s) (?P<rest>.*)")
APART = re.compile(r"frames \d+ and \d+ ")     # of `inter_transmission_time`: two frames too near each other


class CauseLine(NamedTuple):
    text: str
    link: tuple[str, str, str] | None = None    # (medium, sender, receiver), if the line names it
    numbers: tuple[int, ...] = ()
    more: int = 0                               # frames beyond those numbered


def cause_lines(cause: str, on: str = "") -> list[CauseLine]:
    """`on` is what the violation concerns: a link there holds for frames whose line names none."""
    own = LINK.fullmatch(on)
    link = (own["medium"], own["sender"], own["receiver"]) if own else None
    return [line for part in cause.split("; ") for line in _lines(part, link)]


def _lines(part: str, link: tuple[str, str, str] | None) -> Iterator[CauseLine]:
    since = SINCE.fullmatch(part)
    if since:
        yield CauseLine(f"since {since['instant']}:")
        part = since["rest"]
    if APART.match(part):
        yield CauseLine(part)
        return
    at = 0
    for found in FRAMES.finditer(part):
        before = part[at:found.start()].strip(", ")
        at = found.end()
        named = LINK.search(before)
        if named:
            link = (named["medium"], named["sender"], named["receiver"])
            before = before[:named.start()].strip(", ")
        if before:
            yield CauseLine(before.removesuffix(":"))
        numbers = tuple(int(number) for number in found["numbers"].split(", "))
        more = int(found["more"] or 0)
        count = len(numbers) + more
        where = f"{link[0]}: {link[1]} -> {link[2]}: " if link else ""
        yield CauseLine(f"{where}{count} frame{'s' if count > 1 else ''} {found['fate']}", link, numbers, more)
    rest = part[at:].strip(", ")
    if rest:
        yield CauseLine(rest)
