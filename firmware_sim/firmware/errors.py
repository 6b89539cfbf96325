"""Errors of firmware: of its folder, and of its calls of the board's functions."""

from __future__ import annotations


class FirmwareError(ValueError):
    """A folder of firmware is wrong: its table, its C code or what it exports."""

    exit_code = 2


class FirmwareMistake(RuntimeError):
    """A firmware called a function of its board in a way that no board can carry out."""
