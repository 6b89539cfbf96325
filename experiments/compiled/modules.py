"""Which modules are compiled, and under which name the result is kept."""

from __future__ import annotations

import os
import sys
from hashlib import blake2b
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from sysconfig import get_platform
from typing import Final

from fmus.cache import cache_folder

ROOT: Final = Path(__file__).parents[2]
PACKAGES: Final = ("agents", "firmware_sim", "fmus", "netem")
LAYOUT: Final = 2       # counts changes of `build` that change what it builds
MODULES: Final = (
    "fmus.plant",
    "netem.core.agenda",
    "netem.node.environment",
    "netem.core.frame",
    "netem.media.links",
    "netem.emulator.conductor",
    "netem.emulator.seat",
    "netem.transport.hosts",
    "netem.media.broadcast_radio",
    "netem.media.decoding.on_air",
    "netem.media.decoding.radio_network",
    "netem.media.mac.none",
    "netem.node.node",
    "netem.records.ledger",
    "netem.topology.reach",
    "netem.topology.timetable",
    "netem.wire.keys",
    "netem.transport.node_link",
    "netem.transport.placement",
    "netem.transport.process_host",
    "netem.transport.zenoh_session",
    "netem.node.turn",
    "firmware_sim.board",
    "firmware_sim.local_clock",
    "firmware_sim.schedules.slotted_broadcast",
    "agents.synchronization.agreement_law",
    "agents.synchronization.discovered_topology",
    "agents.synchronization.discovery",
    "agents.synchronization.robot",
    "agents.synchronization.sync_frame",
)
EXTENSIONS: Final = {"fmus.bound_calls": "fmus/bound_calls.c"}       # written in C


def file_of(module: str) -> str:
    return f"{module.replace('.', '/')}.py"


def compiled_folder() -> Path:
    """Where the result for the sources as they are now is kept, or would be.

    A compiled module trusts what the annotations of all the others say, so every source of the packages counts.
    OSError if one of them cannot be read.
    """
    python = f"{sys.implementation.cache_tag} {get_platform()} {EXTENSION_SUFFIXES[0]}"
    digest = blake2b(f"{LAYOUT} {python} {MODULES}".encode(), digest_size=8)
    for package in PACKAGES:
        _add(digest, str(ROOT / package))
    for source in EXTENSIONS.values():
        digest.update((ROOT / source).read_bytes())
    return cache_folder() / "compiled" / f"{sys.implementation.cache_tag}-{digest.hexdigest()}"


def found_in(folder: Path) -> dict[str, Path]:
    """The extension modules below `folder` by name; empty unless all are there."""
    suffix = EXTENSION_SUFFIXES[0]
    files = {".".join(file.relative_to(folder).parts).removesuffix(suffix): file
             for file in folder.rglob(f"*{suffix}") if file.stat().st_size}
    whole = files.keys() >= {*MODULES, *EXTENSIONS} and any(name.endswith("__mypyc") for name in files)
    return files if whole else {}


def _add(digest: blake2b, folder: str) -> None:
    with os.scandir(folder) as found:
        entries = sorted(found, key=lambda entry: entry.name)
    for entry in entries:
        if entry.name.endswith(".py") and entry.name[:-3].isidentifier():       # not an editor's .#node.py
            digest.update(f"\0{entry.name}\0".encode())
            with open(entry.path, "rb") as source:
                digest.update(source.read())
        elif entry.is_dir() and entry.name != "__pycache__":
            digest.update(f"\0{entry.name}/".encode())
            _add(digest, entry.path)
