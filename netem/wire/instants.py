"""Instants that the emulator and the nodes both name."""

from __future__ import annotations

from typing import Final

NEVER_NS: Final = 1 << 62       # later than every instant of a run
