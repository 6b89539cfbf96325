"""The page of a view as one text with its style and scripts in it, so that a browser requests no other file."""

from __future__ import annotations

from base64 import b64encode
from functools import cache
from hashlib import sha256
from importlib.resources import files

PAGE = files("experiments.show.view") / "page"


@cache
def page_text() -> str:
    page = (PAGE / "view.html").read_text(encoding="utf-8")
    return page.replace("/*style*/", _style()).replace("/*script*/", _script())


def _style() -> str:
    return (PAGE / "view.css").read_text(encoding="utf-8")


def _script() -> str:
    parts = sorted((part for part in (PAGE / "script").iterdir() if part.name.endswith(".js")),
                   key=lambda part: part.name)
    return "\n".join(part.read_text(encoding="utf-8") for part in parts)


def _hash(text: str) -> str:
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


# The browser loads nothing and runs only this script.
CONTENT_POLICY = (f"default-src 'none'; script-src {_hash(_script())}; style-src 'unsafe-inline'; connect-src 'self'; "
                  "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'")
