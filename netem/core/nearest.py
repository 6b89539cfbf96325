"""The remedy for a name that nobody knows: the nearest known one, or all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from difflib import get_close_matches


def nearest(word: object, known: Iterable[str], cutoff: float = 0.5) -> str | None:
    """The known name most like `word`; None if none is at least `cutoff` (0 to 1) like it."""
    close = get_close_matches(str(word), list(known), 1, cutoff)       # at 0.5, r9 is near r1
    return close[0] if close else None


def did_you_mean(word: object, known: Iterable[str], otherwise: str, *, quote: Callable[[str], str] = repr,
                 cutoff: float = 0.6) -> str:
    close = nearest(word, known, cutoff)
    return otherwise if close is None else f"did you mean {quote(close)}?"
