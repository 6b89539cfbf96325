"""Names the modules that are compiled, and the folder that keeps the result."""

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
LAYOUT: Final = 4       # raised when a change of `build` changes its result
MODULES: Final = (
    "fmus.event_plant",
    "fmus.plant",
    "netem.core.agenda",
    "netem.core.frame",
    "netem.emulator.conductor",
    "netem.emulator.seat",
    "netem.media.broadcast_radio",
    "netem.media.can.admission",
    "netem.media.can.bit_clock",
    "netem.media.can.bus",
    "netem.media.can.bus_events",
    "netem.media.can.bus_load",
    "netem.media.can.bus_state",
    "netem.media.can.bus_timeline",
    "netem.media.can.controller",
    "netem.media.can.crc",
    "netem.media.can.declared",
    "netem.media.can.encoded_frame",
    "netem.media.can.error_handling",
    "netem.media.can.fault_confinement",
    "netem.media.can.frame",
    "netem.media.can.stuffing",
    "netem.media.can.transmit_queue",
    "netem.media.decoding.on_air",
    "netem.media.decoding.radio_network",
    "netem.media.links",
    "netem.media.mac.dcf",
    "netem.media.mac.listening_stations",
    "netem.media.mac.none",
    "netem.media.mac.unslotted",
    "netem.media.medium",
    "netem.media.sensing.sensing",
    "netem.media.sensing.sight",
    "netem.media.serial_line.byte_clock",
    "netem.media.serial_line.reception",
    "netem.media.serial_line.serial_line",
    "netem.media.serial_line.transmitter",
    "netem.node.environment",
    "netem.node.node",
    "netem.node.turn",
    "netem.records.kept_samples",
    "netem.records.ledger",
    "netem.records.sample_buffer",
    "netem.records.sampler",
    "netem.topology.reach",
    "netem.topology.timetable",
    "netem.transport.hosts",
    "netem.transport.node_link",
    "netem.transport.placement",
    "netem.transport.process_host",
    "netem.transport.zenoh_session",
    "netem.wire.keys",
    "firmware_sim.autopilot.attitude_control",
    "firmware_sim.autopilot.autopilot",
    "firmware_sim.autopilot.failsafe",
    "firmware_sim.autopilot.flight",
    "firmware_sim.autopilot.flight_controller",
    "firmware_sim.autopilot.flight_loops",
    "firmware_sim.autopilot.mixer",
    "firmware_sim.autopilot.position_control",
    "firmware_sim.autopilot.position_estimator",
    "firmware_sim.autopilot.ramp",
    "firmware_sim.blocking.calls_in_a_row",
    "firmware_sim.blocking.inbox",
    "firmware_sim.blocking.program",
    "firmware_sim.blocking.program_thread",
    "firmware_sim.blocking.repeating",
    "firmware_sim.blocking.seconds",
    "firmware_sim.board",
    "firmware_sim.board_timers",
    "firmware_sim.drive_controller.drive_controller",
    "firmware_sim.drive_controller.drive_messages",
    "firmware_sim.drive_controller.setpoint_ramp",
    "firmware_sim.drive_controller.setpoint_watch",
    "firmware_sim.drive_controller.speed_loop",
    "firmware_sim.drive_controller.wheel_encoder",
    "firmware_sim.firmware.board_calls",
    "firmware_sim.firmware.plant_variables",
    "firmware_sim.local_clock",
    "firmware_sim.mavlink.counters",
    "firmware_sim.mavlink.front",
    "firmware_sim.mavlink.streams",
    "firmware_sim.mavlink.task",
    "firmware_sim.mavlink.telemetry_port",
    "firmware_sim.processor",
    "firmware_sim.radio_modem",
    "firmware_sim.schedules.periodic",
    "firmware_sim.schedules.slotted_broadcast",
    "firmware_sim.shared_functions",
    "agents.estimation.circle_filter",
    "agents.estimation.curve",
    "agents.pursuit.pursuer",
    "agents.pursuit.sampling.adaptive",
    "agents.pursuit.team_frames",
    "agents.synchronization.agreement_law",
    "agents.synchronization.discovered_topology",
    "agents.synchronization.discovery",
    "agents.synchronization.robot",
    "agents.synchronization.sync_frame",
    "agents.tracking.arcs",
    "agents.tracking.dead_reckoning",
    "agents.tracking.drive_link",
)
# Written in C: the source of each, and the headers of ours that it includes.
EXTENSIONS: Final = {
    "firmware_sim.blocking.c_batons": ("firmware_sim/blocking/c_batons.c",),
    "fmus.bound_calls": ("fmus/bound_calls.c",),
    "firmware_sim.firmware.host.bound_activations": ("firmware_sim/firmware/host/bound_activations.c",
                                                     "firmware_sim/firmware/host/marconet_host.h"),
}


def file_of(module: str) -> str:
    return f"{module.replace('.', '/')}.py"


def compiled_folder() -> Path:
    """Return the folder for the result of the present sources, whether it exists or not.

    Compiled code relies on the annotations of the modules it uses, so the name depends on all sources of the packages.
    Raises OSError if one of them cannot be read.
    """
    python = f"{sys.implementation.cache_tag} {get_platform()} {EXTENSION_SUFFIXES[0]}"
    digest = blake2b(f"{LAYOUT} {python} {MODULES}".encode(), digest_size=8)
    for package in PACKAGES:
        _add(digest, str(ROOT / package))
    for files in EXTENSIONS.values():
        for file in files:
            digest.update((ROOT / file).read_bytes())
    return cache_folder() / "compiled" / f"{sys.implementation.cache_tag}-{digest.hexdigest()}"


def found_in(folder: Path) -> dict[str, Path]:
    """Map the names of the extension modules below `folder` to their files; empty unless all are there."""
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
