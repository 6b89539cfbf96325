"""Errors of images and of what runs on the emulated Cortex-M."""

from __future__ import annotations


class ImageError(ValueError):
    """An .elf file is none that the machine can run, or cannot be built."""


class MachineMissing(RuntimeError):
    """A Python package that the emulated Cortex-M needs is not installed."""


class MachineFault(RuntimeError):
    """A program on the emulated Cortex-M cannot go on."""


class ProgramEnds(MachineFault):
    """A program wrote `code` to the register that ends the run."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


def needs(package: str) -> MachineMissing:
    return MachineMissing(f"the emulated Cortex-M needs the Python package {package}: install it with "
                          "`pip install marconet[cortex-m]`")
