"""Runs a scenario: media, links and records in this process, nodes on a host; the result is a folder of records.

    scenario -> node specifications -> host -> conductor -> ledger, signals -> metrics -> summary, report

A run that fails or is aborted leaves its records up to that instant, with a summary and a report that name the cause. A
run whose process is killed leaves journals, from which `killed_run` makes the records.
"""

from __future__ import annotations

import errno
import gc
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from experiments import CODE
from experiments.judge.metrics import evaluate
from experiments.judge.run_files import CHARTS, SCENARIO, Json
from experiments.judge.run_result import Progress, RunResult, Summary, Verdict
from experiments.run.charts import charts_of
from experiments.run.debugged import CannotDebug, Debugged
from experiments.run.exits import in_words
from experiments.run.guarantee_watch import GuaranteeWatch
from experiments.run.injection import Injection, announce, end_announcement
from experiments.run.network import Network
from experiments.run.node_build import NodeSpecification
from experiments.run.node_host import HostName, open_host
from experiments.run.node_specifications import node_specifications
from experiments.run.recorded_signals import refuse_unrecorded
from experiments.run.repeat import FATES_OF
from experiments.run.replay import Replay, told
from experiments.run.run_folder import RunFolder
from experiments.run.run_records import FolderRecords, RunRecords
from experiments.run.wall_clock_sleep import sleep_refused
from experiments.scenario.model import Scenario
from experiments.scenario.standing_robots import standing_robots
from firmware_sim.mavlink.timesync import Timesync
from netem.core.agenda import Agenda
from netem.core.random_streams import stream
from netem.emulator.conductor import Conductor, Recorders
from netem.emulator.world import RunWorld
from netem.faults.schedule import Occurrence
from netem.gateways import Attends, Gateway, Tell
from netem.gateways.awake import awake
from netem.gateways.pace import Pace
from netem.gateways.real_time_process import EMULATOR_PRIORITY, NODE_PRIORITY, in_real_time
from netem.gateways.table import GATEWAYS
from netem.gateways.time_watch import SIGNALS, TimeWatch
from netem.impairments.traced import Trace
from netem.records.events import Event
from netem.records.ledger import LedgerResult
from netem.records.part_file import reopen_standard_files
from netem.records.uninterrupted import uninterrupted
from netem.transport.diagnosis.under_way import UnderWay
from netem.wire.errors import Interrupted, NodeFailure
from netem.wire.level import Level
from netem.wire.messages import Hello

if TYPE_CHECKING:
    from experiments.run.live.live_run import LiveRun
    from experiments.run.live.server_process import ServerProcess
    from experiments.run.live.steering import Steering
    from netem.gateways.network_settings import NetworkSettings
    from netem.gateways.tls_front import TlsFront

KEEP_EVERY_S = 0.7          # largest age of the records on the disk; the conductor may be 0.1 s late
# The records hold up to 231 000 objects in memory, rows of a chunk of the ledger and buffered samples, and none of them
# is in a cycle. A collection that scans them takes 20 ms, so it waits until there can be nearly as many others.
COLLECT_AFTER_OBJECTS = 400_000
COUNTERS_WITHIN_S = 10.0    # time-out for the counters of the nodes after a failure or an abort


def run(scenario: Scenario, *, host: HostName = "process", out: Path | None = None,
        progress: Callable[[Progress], None] | None = None, report: bool = True,
        shuffle_start: int | None = None, real_time: bool = False, overwrite: bool = False,
        under_way: UnderWay | None = None, replay: Replay | None = None, trace: Trace | None = None,
        view: ServerProcess | None = None, debugged: Debugged | None = None) -> RunResult:
    """Run `scenario` into the folder `out` (default: a new one below ./runs) and, with `report`, write `report.html`.

    `progress` is called while programs prepare and during the run. `real_time` runs at the pace of the wall clock, as
    the scenario's table [real_time] says; gateways require it.
    `shuffle_start` seeds a random order in which the processes are started; the result must not depend on it.
    `overwrite` replaces the records of an earlier run in `out`. `under_way` is memory in which another process can read
    what an inline run was doing when it crashed. With `replay` copies meet the fates of an earlier run instead of the
    scenario's impairments, and its faults act instead of the scenario's. A `trace` notes what impairments do to each
    copy. A `view` shows the run and steers it; the caller tells it the end. The node that is `debugged` waits for gdb.
    Raises NeedsRealTime or FolderTaken before the run; NodeFailure, InstantLoop, Overrun or ConservationError after it,
    with the records written.
    """
    command_s = time.monotonic()
    if scenario.gateways and not real_time:
        raise NeedsRealTime(f"{scenario.name}: gateways.{next(iter(scenario.gateways))} lets somebody outside take "
                            "part, which needs real time: run it with --real-time")
    if real_time and debugged is not None:
        raise CannotDebug(f"--gdb {debugged.node}: while a program stands still, real time does not: run without "
                          "--real-time")
    if replay is not None:
        scenario = msgspec.structs.replace(scenario, faults=replay.faults)
    path = out or Path("runs") / f"{scenario.name}-{datetime.now():%Y%m%d-%H%M%S-%f}"
    folder = RunFolder.claim(path, overwrite=overwrite)
    try:
        fates = {} if replay is None else {FATES_OF: (str(replay.folder.absolute()), replay.match)}
        if real_time or view is not None:
            announce(path)
        SCENARIO.write(path, scenario.resolved() | fates)
        specifications = node_specifications(scenario, partial(_tell_preparing, progress, scenario.length_ns))
        if charts := charts_of(scenario):
            CHARTS.write(path, charts)
        prepared = _Run(scenario, host, FolderRecords(scenario, folder, report), progress, command_s=command_s,
                        specifications=specifications, shuffle_start=shuffle_start, real_time=real_time,
                        under_way=under_way, replay=replay, trace=trace, view=view, debugged=debugged)
    except BaseException:
        folder.abandon()
        raise
    try:
        with _collecting_only_what_the_run_makes():
            return prepared.run()
    finally:
        end_announcement(path)
        folder.release()


def execute(scenario: Scenario, host: HostName, records: RunRecords, specifications: Mapping[str, NodeSpecification],
            under_way: UnderWay | None = None) -> RunResult:
    """Run `scenario` in virtual time into `records`, with the nodes as specified; raises as `run` does."""
    return _Run(scenario, host, records, command_s=time.monotonic(), specifications=specifications,
                under_way=under_way).run()


def _tell_preparing(progress: Callable[[Progress], None] | None, end_ns: int, what: str, done: int, steps: int) -> None:
    if progress is not None:
        progress(Progress(0, end_ns, 0.0, 0, {}, preparing=f"{what}: {done} of {steps}", prepared=done / steps))


@contextmanager
def _collecting_only_what_the_run_makes() -> Iterator[None]:
    """Make the garbage collector ignore older objects, run seldom, and free the cycles of the run at its end.

    A collection of the whole process takes longer than a run of 0.2 s.
    """
    threshold = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(COLLECT_AFTER_OBJECTS, 50, 100)
    try:
        yield
    finally:
        gc.set_threshold(*threshold)
        gc.collect()
        gc.unfreeze()


class NeedsRealTime(ValueError):
    """A scenario with gateways was to run in virtual time."""

    exit_code = 2


class CannotRecord(OSError):
    """The disk has no room for the records of a run."""

    exit_code = 2


class FilesClosed(Exception):
    """A robot program closed files of the emulator, with which it shares a process."""

    exit_code = 3


class _Run:
    def __init__(self, scenario: Scenario, host: HostName, records: RunRecords,
                 progress: Callable[[Progress], None] | None = None, *, command_s: float,
                 specifications: Mapping[str, NodeSpecification], shuffle_start: int | None = None,
                 real_time: bool = False, under_way: UnderWay | None = None, replay: Replay | None = None,
                 trace: Trace | None = None, view: ServerProcess | None = None,
                 debugged: Debugged | None = None) -> None:
        self.scenario = scenario
        self.replay = replay
        self.trace = trace
        self.host_name = host
        self.records = records
        self.folder = records.folder
        self.on_progress = progress
        self.command_s = command_s
        self.agenda = Agenda()
        self.specifications = specifications if debugged is None else debugged.in_specifications(specifications)
        self.feed = records.feed
        self.ledger = records.open_ledger(lambda: self.conductor.passed_ns)
        self.guarantees = GuaranteeWatch(scenario, self.feed)
        self.programs = ExitStack()             # threads of blocking programs and what they replaced, inline
        self.schedules = real_time and scenario.real_time.scheduling == "real_time"
        self.host = open_host(host, self.specifications, self.programs, self.folder, scenario.node_timeout_s,
                              shuffle_start, real_time, NODE_PRIORITY if self.schedules else 0, under_way, self._waits)
        self.conductor = Conductor(self.agenda, self.host, scenario.length_ns, progress=self._progress)
        self.replayed = None if replay is None else replay.links(self.ledger, self.conductor.deliver)
        self.network = Network(scenario, self.agenda, self.ledger, self.conductor.deliver, self.replayed, trace)
        records.begin(self.network.media)
        self.steering: Steering | None = None
        self.live = None if view is None else self._watched_in(view)
        self.conductor.recorders = Recorders(self.feed.sampler(), self.feed.event, self.ledger.receiver_away)
        self.doors = None if scenario.network.tls is None else _front(scenario.network.tls)
        self.at_end = ExitStack()
        if scenario.network.faults_port is not None and (real_time or view is not None):
            self._open_fault_door(scenario.network)
        if real_time:
            gateways = _open_gateways(scenario, self._event_now, self.doors)
            self.conductor.pace = Pace(gateways, self._wall_clock_event, scenario.real_time, {
                spec.name: TimeWatch(Timesync(), partial(self._sample_of_gateway, spec.name), spec.timesync,
                                     partial(self._device_clock_set, spec.name))
                for spec in scenario.gateways.values()})
        self.closed_doors = [] if scenario.network.faults_port is None or real_time or view is not None else [
            f"network.faults_port={scenario.network.faults_port}: is not open: a run in virtual time takes faults only "
            "with --view; start it with --view or --real-time to inject some"]
        self.not_allowed: list[str] = []            # of real-time scheduling, locked memory and processors kept awake
        self.started_s = self.ended_s = command_s
        self.started_processor_s = self.processor_s = 0.0
        self.kept_s = command_s
        self.process = os.getpid()
        self.failure: BaseException | None = None
        self.result: LedgerResult | None = None

    def run(self) -> RunResult:
        try:
            if self.host_name == "inline":
                self.at_end.enter_context(sleep_refused())
            hellos = self.host.start()
            for name in self.scenario.agents:
                self.feed.declare(name, hellos[name].signals)
            for name in self.scenario.gateways:
                self.feed.declare(name, SIGNALS)
            self.guarantees.admit({name: hellos[name].signals for name in self.scenario.agents})
            refuse_unrecorded(self.scenario, self._recorded(hellos))
            self.network.observe(self.feed, self._event_on_medium)
            self.conductor.admit(hellos, self.network.media)
            world = self._plan_faults()
            self._take_from_outside(world)
            with ExitStack() as scheduled:
                if self.schedules:          # `awake` first: its process would inherit the priority
                    asleep = scheduled.enter_context(awake())
                    refused = scheduled.enter_context(in_real_time(EMULATOR_PRIORITY))
                    self.not_allowed = [why for why in (*refused, asleep) if why]
                self.started_s, self.started_processor_s = time.monotonic(), time.process_time()
                self.conductor.run()
                self.ended_s = time.monotonic()
            self.network.finish(self.conductor.end_ns)
            if self.conductor.ended_by:
                self.feed.event(Event(self.conductor.end_ns, self.conductor.ended_by, "run ended",
                                      self.conductor.ended_because))
        except BaseException as error:
            self._fail(error)
        self._leave_if_forked()
        with uninterrupted(drop=True) as came:
            summary = self._conclude()
        if self.failure is not None:
            raise self.failure
        if came:
            raise Interrupted(came[0])
        return RunResult(self.folder, summary)

    def _watched_in(self, view: ServerProcess) -> LiveRun:
        from experiments.run.live.live_run import LiveRun  # late: few runs are watched

        return LiveRun(view, self.scenario, self.feed, self.conductor, self._wall_clock_event)

    def _open_fault_door(self, network: NetworkSettings) -> None:
        from experiments.run.own_doors import FaultDoor  # late: few runs have a door

        assert self.doors is not None                   # the scenario was checked
        self.at_end.callback(FaultDoor(network, self.folder, self.doors, self._event_now).close)

    def _take_from_outside(self, world: RunWorld) -> None:
        """Let faults be injected into a run in real time or with a view, and the view be shown and steer the run."""
        attends: Attends | None = self.conductor.pace
        if attends is None and self.live is not None:
            from experiments.run.live.steering import Steering  # late: few runs are watched

            attends = self.steering = Steering(self.conductor)
            self.at_end.callback(self.steering.close)
        if attends is None:
            return
        if self.doors is not None:
            self.doors.begin(attends)
        injection = Injection(self.scenario, self.folder, self.conductor, attends, world, self._may_kill)
        self.at_end.callback(injection.close)
        if self.live is not None:
            self.live.begin(injection, self.ledger, attends, self.steering, self.folder)

    def _plan_faults(self) -> RunWorld:
        world = RunWorld(self.conductor, self.agenda, self.network.links, partial(stream, self.scenario.seed),
                         self.trace)
        for spec in self.scenario.faults:
            for occurrence in spec.occurrences:
                world.occurs(spec.settings, spec.cause, spec.targets, Occurrence(*occurrence))
        return world

    def _may_kill(self, node: str) -> bool:
        """Return whether the node can be killed, though no fault of the scenario does so."""
        plant = self.specifications[node].plant
        return self.specifications[node].mortal or plant is None or plant.description.saves_state

    def _conclude(self) -> Summary:
        """Close the records, end the nodes, judge and write the summary.

        An exception in one of these steps becomes the failure of the run; the other steps are still carried out.
        """
        if not self.records.hold():
            if isinstance(self.failure, OSError):
                self.failure = None             # a consequence of the closed files
            self._fail(FilesClosed(f"{self.scenario.name}: a robot program closed files of the emulator (os.close or "
                                   "os.closerange): give each robot a process of its own with --host process"))
        reopen_standard_files()
        if self.failure is not None:
            self.ended_s = time.monotonic()
            with suppress(Exception):           # the counters of some nodes stay unknown
                self.conductor.ask_counters(COUNTERS_WITHIN_S)
        reached_ns = self.conductor.end_ns if self.failure is None else self.conductor.reached_ns
        self._step(lambda: self._finish_ledger(reached_ns))
        if self.started_processor_s:
            self.processor_s = time.process_time() - self.started_processor_s
        if self.scenario.guarantees:
            self._step(lambda: self.records.write_guarantees(
                self.guarantees.judge(self.records.copies(), reached_ns, self.conductor.dead_ns)))
        if self.live is not None:
            self._step(partial(self.live.finish, reached_ns))
        for step in self.records.finishing():
            self._step(step)
        self._step(lambda: self.records.write_standing(self._standing(reached_ns)))
        self._step(self.programs.close)
        self._step(self.host.stop)
        if self.doors is not None:
            self._step(self.doors.close)
        self._step(self.at_end.close)
        if self.conductor.pace is not None:
            self._step(self.conductor.pace.close)
        verdicts = self._judged() if self.failure is None and self.scenario.expect else []
        summary = self._summary(verdicts, reached_ns)
        self._step(lambda: self.records.write_summary(summary))
        self._step(self.records.write_report)
        return summary

    def _step(self, step: Callable[[], object]) -> None:
        try:
            step()
        except BaseException as error:
            self._fail(error)

    def _fail(self, error: BaseException) -> None:
        """Keep `error` as the failure of the run, unless there is an earlier one."""
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            error = CannotRecord(f"{self.folder}: cannot write the records: {error.strerror}: free space, or name "
                                 "another folder with --out; what was written before can be read")
        if self.failure is None:
            self.failure = error

    def _finish_ledger(self, reached_ns: int) -> None:
        complete = self.failure is None
        ended_ns = reached_ns if complete else self.conductor.passed_ns
        self.result = self.ledger.finish(end_ns=ended_ns, complete=False)   # returns the counts before any check raises
        if complete:
            self.ledger.finish()

    def _standing(self, reached_ns: int) -> Json:
        """Content of `run.json`: how far the run came, and the counters."""
        return {
            "reached_ns": reached_ns,
            "ended": _end_in_words(self.conductor),
            "failure": None if self.failure is None else in_words(self.failure),
            "switch_instants_ns": self.network.changes_ns(reached_ns),
            "counters": self._counters(),
            "real_time": self._real_time(),
            "dead_ns": self.conductor.dead_ns,
            "replay": self._met(),
        }

    def _counters(self) -> dict[str, dict[str, int]]:
        """Return the counters of programs, gateways and media, by node; those of a medium itself are under its name."""
        of_nodes = {**(self.host.counters() or self.conductor.counted), **self.conductor.counters}
        counters = {node: dict(found) for node, found in of_nodes.items()}
        if self.conductor.pace is not None:
            counters |= {name: dict(found) for name, found in self.conductor.pace.counters().items()}
        self.network.add_counters(counters)
        return counters

    def _judged(self) -> list[Verdict]:
        try:
            return evaluate(self.scenario.expect, self.records.data())
        except Exception as error:
            self._fail(error)
            return []

    def _summary(self, verdicts: list[Verdict], reached_ns: int) -> Summary:
        scenario, conductor, failure = self.scenario, self.conductor, self.failure
        wall_s = self.ended_s - self.started_s
        return Summary(
            scenario.name, scenario.question, scenario.seed, self.host_name, scenario.length_ns, wall_s,
            self.started_s - self.command_s, reached_ns * 1e-9 / wall_s if wall_s > 0 else 0.0, conductor.windows,
            conductor.grants, self.result.hash if self.result else "",
            {fate.value: copies for fate, copies in self.ledger.closed.items() if copies}, verdicts,
            self.records.report, self.guarantees.standings, code=CODE,
            real_time=self._real_time(), ended=_end_in_words(conductor), warnings=self._warnings(), replay=self._met(),
            failure="" if failure is None else in_words(failure),
            last_report=failure.last_report if isinstance(failure, NodeFailure) else "", reached_ns=reached_ns,
            processor_s=self.processor_s)

    def _met(self) -> str:
        """Return how much of an earlier run's fates this run has met; "" if it was not to."""
        return "" if self.replay is None or self.replayed is None else told(self.replay, self.replayed)

    def _keep(self, reached_ns: int) -> None:
        """Write the records so far to the disk, so that they outlive this process if it is killed."""
        self.ledger.keep()
        self.records.keep(self._standing(reached_ns))

    def _leave_if_forked(self) -> None:
        """End this process if a robot program has forked it, as the run belongs to its parent."""
        if os.getpid() != self.process:
            os._exit(0)

    def _warnings(self) -> list[str]:
        of_records = [] if self.failure is not None or self.result is None else self.records.warnings(self.result)
        alone = [] if self.failure is not None or self.conductor.pace is None else self.conductor.pace.alone()
        return [*standing_robots(self.scenario), *self.closed_doors, *self.not_allowed, *alone, *of_records]

    def _recorded(self, hellos: Mapping[str, Hello]) -> dict[str, dict[str, str]]:
        """Return the units of the signals of each agent, medium and table of a medium."""
        found: dict[str, Sequence[tuple[str, str]]] = {
            name: medium.signals for name, medium in self.network.media.items()}
        for medium in self.network.media.values():
            found |= medium.tables()
        found |= {name: hellos[name].signals for name in self.scenario.agents}
        found |= dict.fromkeys(self.scenario.gateways, SIGNALS)
        return {name: dict(signals) for name, signals in found.items()}

    def _wall_clock_event(self, time_ns: int, kind: str, detail: str, level: Level) -> None:
        self.feed.event(Event(time_ns, "", kind, detail, level, wall_clock=True))

    def _sample_of_gateway(self, gateway: str, time_ns: int, values: Sequence[float]) -> None:
        if time_ns <= self.conductor.end_ns:
            self.conductor.recorders.sample(gateway, time_ns, values)

    def _device_clock_set(self, gateway: str) -> None:
        self._event_now("device clock set", f"gateways.{gateway}: the clock of the device outside was set, or the "
                            "device started anew; its offset and drift are estimated anew", Level.WARNING)

    def _event_now(self, kind: str, detail: str, level: Level) -> None:
        pace = self.conductor.pace
        self._wall_clock_event(self.conductor.passed_ns if pace is None else max(pace.now_ns(), 0), kind, detail, level)

    def _real_time(self) -> Json | None:
        """Return lateness and pace of a run in real time; None in virtual time."""
        if self.conductor.pace is None:
            return None
        return {**self.conductor.pace.figures(), "scheduling": self.scenario.real_time.scheduling,
                "not_allowed": self.not_allowed}

    def _event_on_medium(self, event: Event) -> None:
        if event.time_ns < self.conductor.end_ns:   # a medium may report events after the end of the run
            self.feed.event(event)

    def _progress(self, now_ns: int) -> None:
        self._leave_if_forked()
        if self.steering is not None:
            self.steering.poll()
        if self.conductor.pace is not None:
            self.ledger.keep()          # little at a time, since what is due meanwhile is late
        if time.monotonic() > self.kept_s + KEEP_EVERY_S:
            self._keep(now_ns)
            self.kept_s = time.monotonic()
        if self.on_progress is not None:
            frames = {fate.value: copies for fate, copies in self.ledger.closed.items()}
            self.on_progress(Progress(now_ns, self.scenario.length_ns, time.monotonic() - self.started_s,
                                      self.conductor.windows, frames,
                                      held=self.steering is not None and self.steering.holds))

    def _waits(self, nodes: Sequence[str], waited_s: float) -> None:
        if self.on_progress is not None:
            self.on_progress(Progress(self.conductor.reached_ns, self.scenario.length_ns,
                                      time.monotonic() - self.started_s, self.conductor.windows, {}, nodes, waited_s))


def _front(certificates: Path) -> TlsFront:
    from netem.gateways.tls_front import TlsFront  # late: few runs have a door

    return TlsFront(certificates)


def _open_gateways(scenario: Scenario, event: Tell, doors: TlsFront | None) -> list[Gateway]:
    """Return the gateways; if one cannot be opened, those before it are closed again, and all doors."""
    names = (*scenario.agents, *scenario.gateways)
    with ExitStack() as opened:
        if doors is not None:
            opened.callback(doors.close)
        gateways: list[Gateway] = []
        for spec in scenario.gateways.values():
            medium = scenario.media[spec.medium].settings
            gateway: Gateway = GATEWAYS[spec.kind](spec.name, spec.medium, spec.settings, event=event,
                                                   longest_bytes=medium.longest_frame_bytes())
            gateways.append(gateway)
            opened.callback(gateway.close)
            gateway.join(names, medium.datagram_format())
            door = spec.settings.door(spec.name)
            if door is not None:
                assert doors is not None        # the scenario was checked
                gateway.opened(doors.open(f"gateways.{spec.name}", door, gateway.onward(), gateway.tell))
        opened.pop_all()
    return gateways


def _end_in_words(conductor: Conductor) -> str:
    """Return why the run ended before its length, "" if it did not."""
    if not conductor.ended_by:
        return ""
    return f"at {conductor.end_ns / 1e9:.9g} s, by node {conductor.ended_by}: {conductor.ended_because}"
