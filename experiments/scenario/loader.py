"""Loads a scenario file into a `Scenario`, or reports every mistake in it at once.

    file --TOML, overrides--> tables --names, units, types--> header, agents, media, ..., expect
                                     --each class's own rules, links, programs--> Scenario --check of its programs-->
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge, Gt
from msgspec.structs import replace

from experiments.scenario import overrides as overriding
from experiments.scenario.agents import Agents
from experiments.scenario.automata import check_automata, declaring
from experiments.scenario.costs import read_costs
from experiments.scenario.derived import read_derived
from experiments.scenario.document import check_values, read
from experiments.scenario.expect import read_expect
from experiments.scenario.faults import read_faults
from experiments.scenario.gateways import check_doors, check_media, read_gateways
from experiments.scenario.ground import ground_of
from experiments.scenario.guarantees import Guarantees, implied
from experiments.scenario.model import Scenario
from experiments.scenario.network import Network
from experiments.scenario.problems import Place, Problems
from experiments.scenario.question_signal import check_question_signal
from experiments.scenario.records import read_records
from experiments.scenario.sections import SECTIONS, Reading
from experiments.scenario.shape import shape_of
from experiments.scenario.socket_addresses import check_sockets
from experiments.scenario.zenoh_ways import check_ways
from firmware_sim.scenario_view import OwnAgent
from netem.gateways.network_settings import NetworkSettings
from netem.gateways.real_time_settings import RealTimeSettings
from netem.wire.instants import NEVER_NS


@dataclass(frozen=True)
class Header:
    """The values at the top of the file, before its tables."""

    seed: Annotated[int, Ge(0)]
    length_ns: Annotated[int, Gt(0)]
    sample_period_ns: Annotated[int, Ge(0)] = 10_000_000      # 0: no samples
    node_timeout_s: Annotated[float, Gt(0)] = 30.0            # wall-clock time, in seconds
    question_signal: str = ""                                 # "node.signal", shown first in the report
    record: str | tuple[str, ...] = ()                        # recorders with their default settings, as "frames"


def load(source: Path, **changes: Any) -> Scenario:
    """Return the scenario in the file `source`; `changes` as in `load_tables`. ScenarioError lists every problem."""
    return load_tables(*read(source), source, **changes)


def load_tables(document: dict[str, Any], question: str, source: Path, *, seed: int | None = None,
                duration_s: float | None = None, overrides: Sequence[str] = (),
                values: Mapping[str, Any] | None = None) -> Scenario:
    """Return the scenario of these tables, as if they were in the file `source`; paths are relative to its folder.

    `overrides` ("path=value"), `values` (Python values by path), `seed` and `duration_s` replace entries of `document`,
    which is changed. ScenarioError lists every problem.
    """
    problems = Problems(source.name)
    reading = Reading(source.absolute().parent, problems)
    given = {"seed": seed, "length_s": duration_s}
    changes = {**(values or {}), **{key: value for key, value in given.items() if value is not None}}
    if overrides or changes:
        changes = overriding.apply(document, overrides, changes, [*shape_of(Header).keys(), *SECTIONS], problems)
    check_values(document, problems)
    problems.stop_if_any()

    tables: dict[str, Any] = {}
    for key, (kind, rule) in SECTIONS.items():
        tables[key] = document.get(key, kind())
        if not isinstance(tables[key], kind):
            problems.add((key,), rule, tables[key])
            tables[key] = kind()
    header: Header | None = reading.tables.read(
        shape_of(Header), {key: value for key, value in document.items() if key not in SECTIONS}, (), SECTIONS,
        Header).made
    problems.written_at = lambda place: _written_at(document, place)
    agent_reader = Agents(reading, lambda path: overriding.look_up(document, path))
    network, on_media = Network(reading, header.seed if header is not None else 0), list(tables["media"])
    if not tables["agents"] and not tables["gateways"] and not problems.has(("agents",)):
        problems.add(("agents",), "a scenario has at least one agent; add [agents.NAME] with its program")
    agents = {name: agent_reader.agent(name, table, tables["agents_defaults"], on_media)
              for name, table in tables["agents"].items()}
    gateways = read_gateways(tables["gateways"], agents, on_media, reading)
    media = {name: network.medium(name, table, agents, gateways) for name, table in tables["media"].items()}
    check_ways(agents, media, agent_reader.blocking, problems)
    check_media(gateways, media, reading)
    check_sockets(agents, media, agent_reader.blocking, problems)
    network.check_names(table.get("name") if isinstance(table, dict) else None for table in tables["impairments"])
    impairments = tuple(network.impairment(table, ("impairments", index), media)
                        for index, table in enumerate(tables["impairments"]))
    faults = read_faults(tables["faults"], agent_reader, agents, media, *((0, 1) if header is None else (
        header.seed, header.length_ns)), reading)
    derived = read_derived(tables["derived"], agents, reading)
    automata = declaring(agent_reader.programs)
    guaranteeing = Guarantees(reading, agents, media, gateways, derived, network.built, automata, *(
        (NEVER_NS, 1) if header is None else (header.length_ns, header.sample_period_ns)))
    guarantees = guaranteeing.read(tables["guarantees"])
    tables_of_media = network.tables_of_media([*agents, *gateways, *derived, *media])
    recorded = [*agents, *gateways, *derived, *media, *tables_of_media]
    records = read_records(() if header is None else header.record, tables["records"], media, reading)
    network_settings = reading.tables.read(shape_of(NetworkSettings), tables["network"], ("network",), (),
                                           NetworkSettings).made
    if network_settings is not None:
        check_doors(gateways, network_settings, reading)
    real_time = reading.tables.read(shape_of(RealTimeSettings), tables["real_time"], ("real_time",), (),
                                    RealTimeSettings).made
    costs = read_costs(tables["costs"], [*agents, *derived, *media, *tables_of_media], media, derived, reading)
    expect = read_expect(tables["expect"], recorded, media, guarantees, guaranteeing.known(costs), reading)
    if header is not None:
        check_question_signal(header.question_signal, recorded, derived, problems)
    problems.stop_if_any()
    assert header is not None
    assert network_settings is not None
    assert real_time is not None
    scenario = Scenario(source.stem, str(source.absolute()), question, header.seed, header.length_ns,
                        header.sample_period_ns, header.node_timeout_s, tables["team"], agents, media, impairments,
                        gateways, derived, implied(guarantees) | expect, guarantees, records, faults, costs,
                        header.question_signal, real_time=real_time, network=network_settings,
                        changes=changes)
    _ask_programs(scenario, agent_reader.programs, problems)
    problems.stop_if_any()
    modes = check_automata(agent_reader.programs, scenario.team, problems)
    ground = ground_of(agent_reader.programs, scenario.team, problems)
    problems.stop_if_any()
    return replace(scenario, modes=modes, ground=ground) if modes or ground is not None else scenario


def _written_at(document: Mapping[str, Any], place: Place) -> Place:
    """Return the place in the file of a value: that in `agents_defaults` if an agent has it from there."""
    if len(place) < 3 or place[0] != "agents":
        return place
    defaults = document.get("agents_defaults")
    if not overriding.holds(document["agents"], place[1:]) and overriding.holds(defaults, place[2:]):
        return ("agents_defaults", *place[2:])
    return place


def _ask_programs(scenario: Scenario, programs: Mapping[type, Mapping[str, Any]], problems: Problems) -> None:
    """Add the problems that the `check` of each program class finds in the scenario."""
    for cls, settings_of in programs.items():
        check = getattr(cls, "check", None)
        if check is None:
            continue
        own = {name: OwnAgent(name, settings, scenario.agents[name]) for name, settings in settings_of.items()}
        program = scenario.agents[next(iter(own))].program
        try:
            with warnings.catch_warnings():         # `check` reports an overflow by the rule that it breaks
                warnings.simplefilter("ignore", RuntimeWarning)
                found: Iterable[str] = check(scenario, own) or ()
                for problem in found:
                    problems.say(problem)
        except (ValueError, ArithmeticError) as error:
            problems.say(f"{program}: {error}")
        except Exception as error:
            problems.say(f"{program}: its check of the scenario failed: {type(error).__name__}: {error}")
