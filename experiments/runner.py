"""Runs a scenario: media, links and records in this process, nodes on a host, and a folder of evidence at the end.

    scenario -> node specifications -> host -> conductor -> ledger, signals -> metrics -> summary, report

The folder is there whatever happens: a run that is broken off leaves what it has recorded so far.
"""

from __future__ import annotations

import gc
import platform
import random
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import datetime
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from experiments import CODE
from experiments.blocking_programs import is_blocking, refuse_blocking
from experiments.event_levels import level_of
from experiments.guarantee_watch import GuaranteeWatch
from experiments.metrics import evaluate
from experiments.node_build import NodeSpecification, PlantSpecification, Shown, build_node
from experiments.own_modules import class_for
from experiments.recorded_signals import refuse_unrecorded
from experiments.report.build import write_report
from experiments.run_data import load_run
from experiments.run_result import Progress, RunResult, Summary
from experiments.scenario.impairment_kind import impairment_class
from experiments.scenario.model import AgentSpec, Scenario, positions
from experiments.wall_clock_sleep import sleep_refused
from fmus.build import build_model, model_folder, own_models
from fmus.describe import read_model
from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from netem.agenda import Agenda
from netem.fate import Fate
from netem.impairments import Impairment
from netem.impairments.construct import construct_impairment
from netem.impairments.recordings import Recordings
from netem.impairments.window import Window
from netem.links import LinkName, Links
from netem.lockstep.conductor import Conductor, Recorders
from netem.lockstep.hosts import Host, InlineHost
from netem.lockstep.messages import Hello
from netem.media import Medium
from netem.media.can.bus import CanBus
from netem.media.observation import MediumObserver, ObservedMedium
from netem.media.sensing.settings import SensingSettings
from netem.media.table import MEDIA
from netem.outside_guard import OutsideGuard
from netem.random_streams import stream
from netem.real_time.pace import Pace
from netem.real_time.udp_gateway import UdpGateway
from netem.records.events_file import write_events
from netem.records.ledger import Ledger
from netem.records.signals import SignalRecorder
from netem.transport.process_host import ProcessHost
from netem.transport.zenoh_session import ENTRANCES

if TYPE_CHECKING:
    from netem.records.can_log import CanLog

HostName = Literal["process", "inline"]
OWN_PROGRAMS = ("agents.", "firmware_sim.")         # whose import does nothing but define
PACKAGES = ("marconet", "eclipse-zenoh", "fmpy", "numpy", "simpy", "msgspec")


def run(scenario: Scenario, *, host: HostName = "process", out: Path | None = None,
        progress: Callable[[Progress], None] | None = None, report: bool = True,
        shuffle_start: int | None = None, real_time: bool = False) -> RunResult:
    """Run `scenario` into the folder `out` (default: a new one below ./runs), with `report.html` unless told otherwise.

    `real_time`: at the wall clock's pace, with the scenario's gateways to the outside; these need it.
    `shuffle_start` seeds a random order in which the processes are started; the result must not depend on it.
    Raises NodeFailure, InstantLoop or ConservationError after the folder was written, NeedsProcess or NeedsRealTime
    before.
    """
    command_s = time.monotonic()
    if host == "inline":
        refuse_blocking(scenario)
    if scenario.gateways and not real_time:
        raise NeedsRealTime(f"{scenario.name}: gateways.{next(iter(scenario.gateways))} lets somebody outside take "
                            "part, which needs real time: run it with --real-time")
    folder = out or Path("runs") / f"{scenario.name}-{datetime.now():%Y%m%d-%H%M%S-%f}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scenario.json").write_bytes(msgspec.json.encode(scenario.resolved()))
    with _collecting_only_what_the_run_makes():
        return _Run(scenario, host, folder, progress, report, shuffle_start, command_s, real_time).run()


@contextmanager
def _collecting_only_what_the_run_makes() -> Iterator[None]:
    """The garbage collector passes over everything that was there before, seldom looks during the run, and frees the
    run's own cycles at its end: for a run of 0.2 s a collection of the whole process takes longer than the run."""
    threshold = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)
    try:
        yield
    finally:
        gc.set_threshold(*threshold)
        gc.collect()
        gc.unfreeze()


@cache
def _versions() -> dict[str, str]:
    """Of Python and of the packages that a result depends on; looking them up takes longer than a short run."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}


class NeedsRealTime(ValueError):
    """A scenario with gateways in virtual time."""

    exit_code = 2


class _Run:
    def __init__(self, scenario: Scenario, host: HostName, folder: Path, progress: Callable[[Progress], None] | None,
                 report: bool, shuffle_start: int | None, command_s: float,
                 real_time: bool) -> None:
        self.scenario = scenario
        self.host_name = host
        self.folder = folder
        self.on_progress = progress
        self.wants_report = report
        self.command_s = command_s
        names = {"scenario": scenario.name, "seed": str(scenario.seed)}
        self.metadata = names
        self.agenda = Agenda()
        self.ledger = Ledger(folder / "ledger.parquet", metadata=names)
        self.signals = SignalRecorder(folder / "signals.mcap")
        self.guarantees = GuaranteeWatch(scenario, self.signals)
        self.specifications = node_specifications(scenario)
        self.host = _host(host, self.specifications, folder, scenario.node_timeout_s, shuffle_start, real_time)
        self.conductor = Conductor(self.agenda, self.host, scenario.length_ns,
                                   Recorders(self.guarantees.sample, self._event), self._progress)
        links = Links(self.ledger, self.conductor.deliver, _pipelines(scenario), scenario.length_ns)
        self.media = {name: _medium(scenario, name, self.agenda, self.ledger, links) for name in scenario.media}
        self.can_logs = [_can_log(scenario, medium, folder) for medium in self.media.values()
                         if isinstance(medium, CanBus) and medium.settings.log]
        if real_time:
            gateways = [UdpGateway(spec.name, spec.medium, spec.listen, spec.peer, event=self._gateway_event)
                        for spec in scenario.gateways.values()]
            self.conductor.pace = Pace(gateways, self._wall_clock_event)
        self.started_s = self.ended_s = command_s
        self.at_end = ExitStack()

    def run(self) -> RunResult:
        failure: BaseException | None = None
        try:
            if self.host_name == "inline":
                self.at_end.enter_context(sleep_refused())
            hellos = self.host.start()
            for name in self.scenario.agents:
                self.signals.declare(name, hellos[name].signals)
            self.guarantees.admit({name: hellos[name].signals for name in self.scenario.agents})
            refuse_unrecorded(self.scenario, self._recorded(hellos))
            self._observe_media()
            self.conductor.admit(hellos, self.media)
            self.started_s = time.monotonic()
            self.conductor.run()
            self.ended_s = time.monotonic()
            for medium in self.media.values():
                medium.finish(self.conductor.end_ns)
            if self.conductor.ended_by:
                self._event(self.conductor.ended_by, self.conductor.end_ns, "run ended", self.conductor.ended_because)
        except BaseException as error:
            failure = error
            raise
        finally:
            self.host.stop()
            self.at_end.close()
            if self.conductor.pace is not None:
                self.conductor.pace.close()
            self._close(failure)
        return self._judge()

    def _close(self, failure: BaseException | None) -> None:
        """Write the records; ends in a ConservationError if copies of a complete run are missing."""
        reached_ns = self.conductor.end_ns if failure is None else self.conductor.reached_ns
        run = {
            "reached_ns": reached_ns,
            "ended": _end_in_words(self.conductor),
            "failure": None if failure is None else f"{type(failure).__name__}: {failure}",
            "switch_instants_ns": {name: _changes(medium, reached_ns) for name, medium in self.media.items()},
            "counters": _counters(self.conductor.counters, self.media),
            "real_time": self._real_time(),
            "versions": _versions(),
        }
        (self.folder / "run.json").write_bytes(msgspec.json.encode(run))
        for log in self.can_logs:
            log.finish()
        try:
            self.result = self.ledger.finish(complete=failure is None)
        finally:
            try:
                self.guarantees.judge(self.folder, reached_ns)
            finally:
                write_events(self.folder / "ledger_events.parquet", self.signals.events)
                self.signals.finish(self.metadata, msgspec.json.encode(self.scenario.resolved()))

    def _judge(self) -> RunResult:
        wall_s = self.ended_s - self.started_s
        verdicts = evaluate(self.scenario.expect, load_run(self.folder)) if self.scenario.expect else []
        scenario, conductor = self.scenario, self.conductor
        summary = Summary(
            scenario.name, scenario.question, scenario.seed, self.host_name, scenario.length_ns, wall_s,
            self.started_s - self.command_s, conductor.end_ns * 1e-9 / wall_s, conductor.windows, conductor.grants,
            self.result.hash, dict(self.result.by_fate), verdicts, "report.html" if self.wants_report else None,
            self.guarantees.standings, code=CODE, real_time=self._real_time(), ended=_end_in_words(conductor),
            warnings=self._malformed())
        (self.folder / "summary.json").write_bytes(msgspec.json.encode(summary))
        if self.wants_report:
            write_report(self.folder)
        return RunResult(self.folder, summary)

    def _malformed(self) -> list[str]:
        """A line for each node and reason, if frames were no frames of their medium."""
        if not self.result.by_fate.get(Fate.MALFORMED.value):
            return []
        from netem.records.malformed import malformed_frames

        return malformed_frames(self.folder / "ledger.parquet")

    def _event(self, node: str, time_ns: int, kind: str, detail: str) -> None:
        self.signals.event(time_ns, node, kind, detail, level_of(kind))

    def _recorded(self, hellos: Mapping[str, Hello]) -> dict[str, list[str]]:
        """The names of the signals of each agent and medium."""
        found = {name: getattr(medium, "signals", ()) for name, medium in self.media.items()}
        found |= {name: hellos[name].signals for name in self.scenario.agents}
        return {name: [signal for signal, _ in signals] for name, signals in found.items()}

    def _wall_clock_event(self, time_ns: int, kind: str, detail: str) -> None:
        self.signals.event(time_ns, "", kind, detail, level_of(kind), wall_clock=True)

    def _gateway_event(self, kind: str, detail: str) -> None:
        assert self.conductor.pace is not None
        self._wall_clock_event(max(self.conductor.pace.now_ns(), 0), kind, detail)

    def _real_time(self) -> dict[str, int] | None:
        """Lateness of a run in real time; None in virtual time."""
        return None if self.conductor.pace is None else self.conductor.pace.lateness.figures()

    def _observe_media(self) -> None:
        for name, medium in self.media.items():
            if isinstance(medium, ObservedMedium):
                if medium.signals:
                    self.signals.declare(name, medium.signals)
                medium.observe(MediumObserver(self._event_on_medium, self.signals.append))

    def _event_on_medium(self, time_ns: int, node: str, kind: str, detail: str) -> None:
        if time_ns < self.conductor.end_ns:         # a medium may know ahead how a frame will end
            self.signals.event(time_ns, node, kind, detail, level_of(kind))

    def _progress(self, now_ns: int) -> None:
        if self.on_progress is not None:
            frames = {fate.value: copies for fate, copies in self.ledger.closed.items()}
            self.on_progress(Progress(now_ns, self.scenario.length_ns, time.monotonic() - self.started_s,
                                      self.conductor.windows, frames))


def node_specifications(scenario: Scenario) -> dict[str, NodeSpecification]:
    """One for each agent. What a program class prepares for its team (`prepare`) is part of what the team knows."""
    team: dict[str, Any] = dict(scenario.team)
    blocking = set()
    for path in sorted({agent.program for agent in scenario.agents.values()}):
        program = class_for(path, scenario.folder)
        if is_blocking(program):
            blocking.add(path)
        elif (prepare := getattr(program, "prepare", None)) is not None:
            team.update(prepare(scenario))
    folder = str(scenario.folder)
    fmus = {agent.plant.fmu for agent in scenario.agents.values() if agent.plant is not None}
    described = {fmu: describe(build_model(fmu) if fmu in own_models() else Path(fmu)) for fmu in sorted(fmus)}
    return {name: NodeSpecification(name, agent.program, agent.parameters, _kinds(scenario, agent), agent.clock,
                                    _plant(agent, described), team, scenario.sample_period_ns, scenario.seed, folder,
                                    agent.program in blocking, _own_frames(scenario, agent), _shown(scenario, agent))
            for name, agent in scenario.agents.items()}


def _kinds(scenario: Scenario, agent: AgentSpec) -> dict[str, str]:
    return {medium: scenario.media[medium].kind for medium in agent.media}


def _own_frames(scenario: Scenario, agent: AgentSpec) -> tuple[str, ...]:
    return tuple(medium for medium in agent.media
                 if agent.name in getattr(scenario.media[medium].settings, "own_frames_to", ()))


def _shown(scenario: Scenario, agent: AgentSpec) -> tuple[Shown, ...]:
    return tuple(Shown(medium, settings.exposure_period_ns, settings.bodies[agent.name])
                 for medium in agent.media if isinstance(settings := scenario.media[medium].settings, SensingSettings)
                 and agent.name in settings.bodies)


def _plant(agent: AgentSpec, described: Mapping[str, PlantDescription]) -> PlantSpecification | None:
    if agent.plant is None:
        return None
    fmu, plant = agent.plant.fmu, described[agent.plant.fmu]
    parameters, step_ns = agent.plant.parameters, agent.plant.step_ns
    if fmu not in own_models():
        return PlantSpecification(plant, parameters, step_ns)
    idle = read_model(model_folder(fmu) / "variables.toml").idle_outputs(parameters)
    return PlantSpecification(plant, parameters, step_ns, idle)


def _host(host: HostName, specifications: Mapping[str, NodeSpecification], folder: Path, timeout_s: float,
          shuffle_start: int | None, real_time: bool) -> Host:
    if host == "inline":
        return InlineHost({name: partial(build_node, specification) for name, specification in specifications.items()},
                          None if real_time else OutsideGuard(ENTRANCES))
    order = list(specifications)
    if shuffle_start is not None:
        random.Random(shuffle_start).shuffle(order)
    # -P: modules come from where they are installed or from the scenario's folder, not from the current one
    programs = sorted({specification.program.partition(":")[0] for specification in specifications.values()})
    return ProcessHost([sys.executable, "-P", "-m", "experiments.node_process",
                        *(module for module in programs if module.startswith(OWN_PROGRAMS))],
                       {name: msgspec.json.encode(specifications[name]) for name in order},
                       logs=folder / "logs", timeout_s=timeout_s, real_time=real_time)


def _medium(scenario: Scenario, name: str, agenda: Agenda, ledger: Ledger, links: Links) -> Medium:
    spec = scenario.media[name]
    at_m = positions(spec.nodes, scenario.agents)
    medium: Medium = MEDIA[spec.kind](name, spec.settings, at_m, agenda, ledger, links, partial(stream, scenario.seed))
    return medium


def _can_log(scenario: Scenario, bus: CanBus, folder: Path) -> CanLog:
    from netem.records.can_log import CanLog  # late: a run without such logs needs no python-can

    log = CanLog(folder, bus.name, bus.settings.log, scenario.length_ns)
    bus.logs.append(log)
    return log


def _end_in_words(conductor: Conductor) -> str:
    """Why the run ended before its length, "" if it did not."""
    if not conductor.ended_by:
        return ""
    return f"at {conductor.end_ns / 1e9:.9g} s, by node {conductor.ended_by}: {conductor.ended_because}"


def _counters(of_nodes: Mapping[str, Mapping[str, int]], media: Mapping[str, Medium]) -> dict[str, dict[str, int]]:
    """What programs counted and what media counted, by node; a medium's own under its name."""
    counters = {node: dict(found) for node, found in of_nodes.items()}
    for medium in media.values():
        if isinstance(medium, ObservedMedium):
            for node, found in medium.counters().items():
                own = counters.setdefault(node, {})
                for name, count in found.items():
                    own[name] = own.get(name, 0) + count
    return counters


def _pipelines(scenario: Scenario) -> dict[LinkName, list[tuple[str, Impairment]]]:
    """Each directed link's own impairments in the order of the scenario, each with its own random stream."""
    pipelines: dict[LinkName, list[tuple[str, Impairment]]] = {}
    recordings = Recordings()
    for spec in scenario.impairments:
        kind = impairment_class(spec.kind, scenario.folder)
        for link in spec.links:
            place = f"{spec.called}/{link[0]}: {link[1]} -> {link[2]}"
            impairment: Any = construct_impairment(kind, spec.fields, stream(scenario.seed, place), recordings)
            if spec.windows_ns:
                impairment = Window(impairment, spec.windows_ns)
            pipelines.setdefault(link, []).append((f"{spec.called} {spec.kind}", impairment))
    return pipelines


def _changes(medium: Medium, until_ns: int) -> Sequence[int]:
    topology = getattr(medium, "topology", None)
    return topology.changes_ns(until_ns) if topology is not None else []
