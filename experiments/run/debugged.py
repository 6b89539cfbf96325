"""`marconet run --gdb NODE`: the robot whose emulated processor waits for gdb, and where.

The port is reserved before the run, so that the command to type can be printed; the robot's process opens it.
"""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Final, NamedTuple

import msgspec

from experiments.programs.firmware_programs import class_for
from experiments.run.node_build import NodeSpecification
from experiments.scenario.model import Scenario
from experiments.scenario.problems import near
from firmware_sim.program_settings import build_settings

CLIENTS: Final = ("gdb-multiarch", "arm-none-eabi-gdb")


class CannotDebug(ValueError):
    """A debugger was asked for where none can be."""

    exit_code = 2


class Debugged(NamedTuple):
    node: str
    port: int
    image: Path
    sources: tuple[Path, ...]           # folders

    @property
    def command(self) -> str:
        """The command that starts gdb, connected."""
        client = next((name for name in CLIENTS if shutil.which(name)), CLIENTS[0])
        return shlex.join([client, "-q", *(word for folder in self.sources for word in ("-d", str(folder))),
                           "-ex", f"target remote 127.0.0.1:{self.port}", str(self.image)])

    def in_specifications(self, specifications: Mapping[str, NodeSpecification]) -> dict[str, NodeSpecification]:
        """Return the specifications, that of the node with the port."""
        return {name: msgspec.structs.replace(specification, debug_port=self.port) if name == self.node
                else specification for name, specification in specifications.items()}


@contextmanager
def awaiting_debugger(scenario: Scenario, place: str | None) -> Iterator[Debugged | None]:
    """Yield where gdb is waited for, with the port reserved; `place` is "NODE" or "NODE:PORT", None for no debugger.

    Raises CannotDebug for a node without an emulated processor or a port that is taken.
    """
    if place is None:
        yield None
        return
    from firmware_sim.cortex_m.gdb.listener import reserve  # late: few runs are debugged

    node, _, port = place.partition(":")
    if port and not (port.isdecimal() and int(port) < 65536):
        raise CannotDebug(f"--gdb {place}: expected NODE or NODE:PORT, as {node}:3333")
    image, *sources = _files(scenario, node)
    try:
        reserved = reserve(int(port or 0))
    except OSError as error:
        raise CannotDebug(f"--gdb {place}: port {port}: {error.strerror}: leave it out, for any free one") from None
    with reserved:
        yield Debugged(node, reserved.getsockname()[1], image, tuple(sources))


def _files(scenario: Scenario, node: str) -> tuple[Path, ...]:
    """Return the image of the node, and folders with its sources."""
    if node not in scenario.agents:
        raise CannotDebug(f"--gdb {node}: no such agent; {near(node, list(scenario.agents))}")
    agent = scenario.agents[node]
    program = class_for(agent.program, scenario.folder)
    if not hasattr(program, "debugged_with"):
        raise CannotDebug(f"--gdb {node}: its program does not run on an emulated processor: expected a firmware with "
                          f"agents.{node}.target = \"cortex_m4\", or an .elf file; debug others as any process, with "
                          "--host inline")
    files: tuple[Path, ...] = program.debugged_with(build_settings(program, agent.parameters))
    return files
