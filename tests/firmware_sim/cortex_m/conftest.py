"""Images for the emulated Cortex-M, built from images/*.c; tests skip where a package of the extra is absent."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import pytest

from firmware_sim.cortex_m.build import build_image

IMAGES = Path(__file__).parent / "images"
PACKAGES = {"unicorn": "unicorn", "elftools": "pyelftools", "ziglang": "ziglang"}


@pytest.fixture(scope="session")
def image() -> Callable[..., Path]:
    """Return a function that builds images/NAME.c and returns the path of its .elf file."""
    for module, package in PACKAGES.items():
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"needs {package}: pip install 'marconet[cortex-m]'")

    def build(name: str, *options: str) -> Path:
        return build_image(name, {f"{name}.c": (IMAGES / f"{name}.c").read_bytes()}, options)

    return build
