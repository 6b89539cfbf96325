"""Blank lines before lists and tables, which Markdown in Python wants and GitHub does not: for pages and docstrings."""

from __future__ import annotations

import re
from typing import Any, Final

import griffe

FIRST_ITEM: Final = re.compile(r"^(?!- |\* |\||>|\d+\. )(\S.*)\n(?=- |\| |\d+\. )", re.MULTILINE)


def spaced(text: str) -> str:
    """`text` with a blank line between a paragraph and the list or table that follows it."""
    return FIRST_ITEM.sub(r"\1\n\n", text)


class MarkdownLists(griffe.Extension):
    """Spaces the docstring of every object that the reference shows."""

    def on_instance(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        if obj.docstring is not None:
            obj.docstring.value = spaced(obj.docstring.value)
