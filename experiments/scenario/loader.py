"""A scenario file into a `Scenario`, or into every mistake in it at once.

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

from experiments.scenario import overrides as overriding
from experiments.scenario.agents import Agents
from experiments.scenario.derived import read_derived
from experiments.scenario.document import check_values, question_of, read
from experiments.scenario.expect import read_expect
from experiments.scenario.fill import construct
from experiments.scenario.gateways import read_gateways
from experiments.scenario.guarantees import Guarantees, implied
from experiments.scenario.model import Scenario
from experiments.scenario.network import Network
from experiments.scenario.problems import Place, Problems
from experiments.scenario.question_signal import check_question_signal
from experiments.scenario.records import read_records
from experiments.scenario.sections import SECTIONS, Reading, holds
from experiments.scenario.shape import shape_of
from experiments.scenario.units import siblings
from experiments.scenario.vocabulary import Vocabulary


@dataclass(frozen=True)
class Header:
    """The single values at the top of the file."""

    seed: Annotated[int, Ge(0)]
    length_ns: Annotated[int, Gt(0)]
    sample_period_ns: Annotated[int, Ge(0)] = 10_000_000      # 0: no samples
    node_timeout_s: Annotated[float, Gt(0)] = 30.0            # wall clock: stays in seconds
    question_signal: str = ""                                 # "node.signal", shown first in the report


def load(source: Path, *, seed: int | None = None, duration_s: float | None = None, overrides: Sequence[str] = (),
         values: Mapping[str, Any] | None = None, vocabulary: Vocabulary | None = None) -> Scenario:
    """The scenario in the file `source`; `seed`, `duration_s`, `overrides` and `values` replace what it says.

    ScenarioError holds every problem found.
    """
    document, text = read(source)
    return load_tables(document, source, question=question_of(text), seed=seed, duration_s=duration_s,
                       overrides=overrides, values=values, vocabulary=vocabulary)


def load_tables(document: dict[str, Any], source: Path, *, question: str = "", seed: int | None = None,
                duration_s: float | None = None, overrides: Sequence[str] = (), values: Mapping[str, Any] | None = None,
                vocabulary: Vocabulary | None = None) -> Scenario:
    """The scenario of these tables, as if they had been read from the file `source`, whose folder its paths start from.

    `document` is changed. `values` are overrides in Python's types, by their paths.
    """
    problems = Problems(source.name)
    top_level = [*shape_of(Header).keys(), *SECTIONS]
    overriding.apply(document, overrides, top_level, problems)
    overriding.apply_values(document, values or {}, top_level, problems)
    if seed is not None:
        document["seed"] = seed
    if duration_s is not None:
        for other in siblings("length_s"):
            document.pop(other, None)
        document["length_s"] = duration_s
    check_values(document, problems)
    problems.stop_if_any()
    if vocabulary is None:
        from experiments.scenario.house import house_vocabulary
        vocabulary = house_vocabulary()
    return _resolve(Reading(document, source.absolute().parent, problems, vocabulary), source, question)


def _resolve(reading: Reading, source: Path, question: str) -> Scenario:
    problems = reading.problems
    tables = {key: reading.section(key) for key in SECTIONS if key != "impairments"}
    own = {key: value for key, value in reading.document.items() if key not in SECTIONS}
    header = construct(Header, own, (), problems, reading.folder, besides=SECTIONS)
    problems.written_at = lambda place: _written_at(reading, place)
    agent_reader, network = Agents(reading), Network(reading)
    agents = agent_reader.read(tables["agents"], tables["agents_defaults"], list(tables["media"]))
    gateways = read_gateways(tables["gateways"], agents, list(tables["media"]), reading)
    media = network.media(tables["media"], agents, gateways)
    impairments = network.impairments(media)
    derived = read_derived(tables["derived"], agents, reading)
    guarantees = Guarantees(reading, agents, media, derived, *(
        (0, 1) if header is None else (header.length_ns, header.sample_period_ns))).read(tables["guarantees"])
    recorded = [*agents, *gateways, *derived, *media]
    records = read_records(tables["records"], reading)
    expect = read_expect(tables["expect"], recorded, media, guarantees, reading)
    if header is not None:
        check_question_signal(header.question_signal, recorded, derived, problems)
    problems.stop_if_any()
    scenario = Scenario(source.stem, str(source.absolute()), question, header.seed, header.length_ns,
                        header.sample_period_ns, header.node_timeout_s, tables["team"], agents, media, impairments,
                        gateways, derived, implied(guarantees) | expect, guarantees, records, header.question_signal)
    _ask_programs(scenario, agent_reader.programs, problems)
    problems.stop_if_any()
    return scenario


def _written_at(reading: Reading, place: Place) -> Place:
    """What an agent has from `agents_defaults` was written there."""
    if len(place) < 3 or place[0] != "agents":
        return place
    defaults = reading.document.get("agents_defaults")
    if not holds(reading.document["agents"], place[1:]) and holds(defaults, place[2:]):
        return ("agents_defaults", *place[2:])
    return place


def _ask_programs(scenario: Scenario, programs: Mapping[type, str], problems: Problems) -> None:
    """A program's class may refuse a run that its domain knows to be impossible."""
    for cls, program in programs.items():
        check = getattr(cls, "check", None)
        if check is None:
            continue
        try:
            with warnings.catch_warnings():         # figures beyond all bounds are told as what they break
                warnings.simplefilter("ignore", RuntimeWarning)
                found: Iterable[str] = check(scenario) or ()
                for problem in found:
                    problems.say(problem)
        except (ValueError, ArithmeticError) as error:
            problems.say(f"{program}: {error}")
        except Exception as error:
            problems.say(f"{program}: its check of the scenario failed: {type(error).__name__}: {error}")
