"""The name of one directed link."""

from __future__ import annotations

LinkName = tuple[str, str, str]         # (medium, sender, receiver)
