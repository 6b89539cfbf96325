"""The remedy in an error about an unknown name: the nearest known name, or another text."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from difflib import get_close_matches


def nearest(word: object, known: Iterable[str], cutoff: float = 0.5) -> str | None:
    """Return the known name most similar to `word`; None if no similarity reaches `cutoff` (0 to 1)."""
    close = get_close_matches(str(word), list(known), 1, cutoff)       # at 0.5, r9 is near r1
    return close[0] if close else None


def did_you_mean(word: object, known: Iterable[str], otherwise: str, *, quote: Callable[[str], str] = repr,
                 cutoff: float = 0.6) -> str:
    """Return "did you mean ...?" with the nearest known name, or `otherwise` if there is none."""
    close = nearest(word, known, cutoff)
    return otherwise if close is None else f"did you mean {quote(close)}?"
