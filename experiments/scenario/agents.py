"""`[agents]` and `[agents_defaults]`: nodes with their programs, clocks and plants."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from experiments.programs.firmware_programs import ELF, Target, is_firmware, program_of
from experiments.scenario.blocking_programs import is_blocking
from experiments.scenario.firmware_target import target_complaint
from experiments.scenario.model import AgentSpec, PlantSpec
from experiments.scenario.overrides import parse_path
from experiments.scenario.plant_parameters import PlantNames, plant_names
from experiments.scenario.problems import Place, near
from experiments.scenario.program import check_program
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from experiments.scenario.units import siblings, spellings
from experiments.scenario.zenoh_ways import ways
from firmware_sim.clock_settings import ClockSettings


@dataclass(frozen=True)
class PlantTable:
    fmu: str
    preset: str | None = None
    parameters: dict[str, Any] = field(default_factory=dict)
    parameters_from: str | None = None
    step_ns: int | None = None


@dataclass(frozen=True)
class AgentTable:
    program: str = ""                               # either it or `firmware`
    firmware: str = ""          # a folder with firmware.toml, the name of one of marconet's, or an .elf file
    target: str = "host"                            # where the firmware runs
    clock_hz: int = 100_000_000                     # of an emulated processor
    cycles_per_instruction: float = 0.0             # 0: computing takes no time
    parameters: dict[str, Any] = field(default_factory=dict)
    clock: ClockSettings = field(default_factory=ClockSettings)
    plant: PlantTable | None = None
    at_m: tuple[float, ...] | None = None
    media: tuple[str, ...] | None = None
    zenoh: str | dict[str, str] | None = None       # medium, or key expression -> medium
    sockets: dict[str, str] = field(default_factory=dict)


WITH_FIRMWARE: Final = shape_of(AgentTable)
WITH_PROGRAM: Final = replace(WITH_FIRMWARE, required=frozenset({"program"}))


class Agents:
    """Reads the agents; `programs` maps each program class to the settings of the agents that run it, by name, and
    `plants` each agent with a plant to the names in it.

    `look_up` returns the table at a path in the file, and a problem of the path or "".
    """

    def __init__(self, reading: Reading, look_up: Callable[[str], tuple[dict[str, Any], str]]) -> None:
        self.reading = reading
        self.look_up = look_up
        self.problems = reading.problems
        self.programs: dict[type, dict[str, Any]] = {}
        self.plants: dict[str, PlantNames] = {}
        self.blocking: dict[str, bool] = {}     # of each agent whose program could be read

    def agent(self, name: str, table: Any, defaults: dict[str, Any], media: Sequence[str]) -> AgentSpec:
        """Return the agent; with mistakes in it, without its wrong parts, as other sections may refer to it."""
        place = ("agents", name)
        self.reading.check_name(place, name)
        merged = table
        if defaults and isinstance(table, dict):
            dropped = _of_the_other("firmware" in table, "program" in table)
            merged = _merged({key: value for key, value in defaults.items() if key not in dropped}, table)
        has_firmware = isinstance(merged, dict) and "firmware" in merged
        values = self.reading.tables.read(WITH_FIRMWARE if has_firmware else WITH_PROGRAM, merged, place).values
        written = values.pop("parameters", {})
        found = AgentTable(**values)
        program, key = self._program(found, frozenset(merged if isinstance(merged, dict) else ()), set(values), place)
        parameters: dict[str, Any] = {}
        if key:
            cls, parameters, settings = check_program(program, written, place, self.reading.tables, key,
                                                      found.firmware if key == "firmware" else "")
            if cls is not None:
                self.blocking[name] = is_blocking(cls)
            if isinstance(cls, type):
                self.programs.setdefault(cls, {})[name] = settings
        plant = None if found.plant is None else self._plant(found.plant, merged["plant"], (*place, "plant"))
        attached = media if found.media is None else found.media
        for index, medium in enumerate(attached):
            if medium not in media:
                self.problems.add((*place, "media", index), f"no such medium; {near(medium, media)}", medium)
                attached = media
        if found.at_m is not None and len(found.at_m) not in (2, 3):
            self.problems.add((*place, "at_m"), "expected [x, y] or [x, y, z]", list(found.at_m))
        return AgentSpec(name, program, parameters, found.clock, plant, found.at_m, tuple(attached),
                         ways(found.zenoh), found.sockets)

    def _program(self, table: AgentTable, written: Collection[str], read: Collection[str],
                 place: Place) -> tuple[str, str]:
        """Return the agent's program and the key that names it, "" if none can be found.

        `written` are the keys that the author has written, `read` those whose values have the right type.
        """
        if "program" in written and "firmware" in written:
            self.problems.add((*place, "firmware"), "expected either `program` or `firmware`: remove one of them",
                              table.firmware)
            return "", ""
        if "firmware" not in written:
            if "target" in written:
                self.problems.add((*place, "target"), "expected `firmware` with it: a program in Python runs in its "
                                                      "node's process", table.target)
            if is_firmware(table.program):
                self.problems.add((*place, "program"), f"write firmware = \"{table.program.rpartition(':')[2]}\" "
                                                       "instead of it", table.program)
                return "", ""
            return table.program, "program" if "program" in read else ""
        name = "cortex_m4" if table.firmware.endswith(ELF) and "target" not in written else table.target
        target = Target(name, table.clock_hz, table.cycles_per_instruction)
        if complaint := target_complaint(target, table.firmware):
            self.problems.add((*place, "target"), complaint, table.target)
            return "", ""
        return program_of(table.firmware, target), "firmware" if "firmware" in read else ""

    def _plant(self, table: PlantTable, written: Mapping[str, Any], place: Place) -> PlantSpec | None:
        try:
            plant = plant_names(table.fmu, self.reading.folder)
        except ValueError as error:
            self.problems.add((*place, "fmu"), str(error), table.fmu)
            return None
        self.plants[str(place[1])] = plant
        before = self.problems.found
        if table.preset is not None and table.preset not in plant.presets:
            self.problems.add((*place, "preset"), f"no such preset of {table.fmu}; {near(table.preset, plant.presets)}",
                              table.preset)
        start: dict[str, Any] = {}
        if table.parameters_from is not None:
            found, complaint = self.look_up(table.parameters_from)
            start = plant.taken_from(found)
            if found and not start:
                complaint = f"no key of that table is a parameter of {table.fmu}; {near('', plant.parameters)}"
            if complaint:
                self.problems.add((*place, "parameters_from"), complaint, table.parameters_from)
        given = {**start, **table.parameters}
        for key, complaint in plant.complaints(given).items():
            where = (*place, "parameters", key) if key in table.parameters \
                else (*parse_path(table.parameters_from or "")[0], key)
            self.problems.add(where, complaint, given[key])
        if complaint := plant.step_complaint(table.step_ns):
            key = next((key for key in spellings("step_ns") if key in written), "step_ms")
            self.problems.add((*place, key), complaint, *([written[key]] if key in written else []))
        return PlantSpec(plant.fmu, given if self.problems.found > before else plant.over_preset(table.preset, given),
                         table.step_ns)


def _of_the_other(has_firmware: bool, has_program: bool) -> frozenset[str]:
    """Return the keys of the program, if an agent has a firmware, and the other way round."""
    if has_firmware:
        return frozenset({"program"})
    return frozenset({"firmware", "target", "clock_hz", "cycles_per_instruction"} if has_program else ())


def _merged(defaults: dict[str, Any], table: dict[str, Any]) -> dict[str, Any]:
    """Return `defaults` with the values of `table`, nested tables included; a time replaces one in another unit."""
    merged = {key: value for key, value in defaults.items() if not any(other in table for other in siblings(key))}
    for key, value in table.items():
        below = merged.get(key)
        merged[key] = _merged(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return merged
