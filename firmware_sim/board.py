"""The interface of a robot's program: its ports, timers on its clock, its sensors and actuators, and its records.

    board.port(name)                        send and receive frames
    board.at / every / sleep_until          act at an instant of the local clock
    board.sense / actuate                   read and drive the plant, at the present
    board.count / record / event / warn     write to the records of the run

All times are local: readings of this robot's clock. A timer is armed at the instant computed from the clock's present
offset and rate, as in a microcontroller. If the clock is set back meanwhile, the timer waits until the clock reads its
time; if it is set forward, the timer acts late, by the step.

**The promise of silence** follows from the timers: this robot sends nothing before the first timer that may lead to a
frame. The promise is firm if every port is `listen_only`. Otherwise an arriving frame ends the promise and the robot
gives a new one, so a reply from `on_receive` breaks none. For a timer that leads to no frame the program says so
(`sends=False`, `silent_until_ns`); then the emulator need not contact this robot for it. A frame sent within the
promise raises PromiseBroken.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from functools import partial
from random import Random
from typing import Any, ClassVar, Final

from simpy.events import Event, Process, Timeout

from firmware_sim.board_timers import Repetition, Timer, Timers
from firmware_sim.local_clock import LocalClock
from firmware_sim.old_names import OldName
from firmware_sim.processor import Processor
from fmus.call_record import CallRecord, NoRecord
from fmus.event_plant import EventPlant
from fmus.plant import InputGroup, OutputGroup, Plant
from netem.node.node import Node, Port
from netem.wire.level import Level

MAX_WAITS_AT_ONE_INSTANT: Final = 100_000


class NoPlant(ValueError):
    """A program uses a sensor or an actuator, but its robot has no plant."""


class Board:
    # Former names: to read one is an error that says what to write.
    node: ClassVar = OldName("node")
    plant: ClassVar = OldName("plant")
    clock: ClassVar = OldName("clock")
    wait_until: ClassVar = OldName("wait_until")
    silent_until: ClassVar = OldName("silent_until")
    silent_unless_heard_until: ClassVar = OldName("silent_unless_heard_until")

    def __init__(self, node: Node, clock: LocalClock, plant: Plant | None, team: Mapping[str, Any], rng: Random,
                 parameters: Mapping[str, Any], processor: Processor | None = None,
                 call_record: CallRecord | None = None, debug_port: int = 0, can_buses: Collection[str] = (),
                 byte_streams: Collection[str] = ()) -> None:
        """`team`: the scenario's table [team]; `debug_port`: TCP port where an emulated processor awaits a debugger.

        `can_buses`, `byte_streams`: ports on media of these kinds."""
        self.debug_port = debug_port                    # 0: none
        self.call_record: CallRecord = NoRecord() if call_record is None else call_record   # for programs in C
        self.name = node.name
        self.team = team
        self.can_buses, self.byte_streams = frozenset(can_buses), frozenset(byte_streams)
        self.rng = rng
        self._node, self._clock, self._plant, self._parameters = node, clock, plant, parameters
        self._timers = Timers(node, clock)
        self._same_oscillator: tuple[LocalClock, ...] = (clock,)
        self._processor = Processor() if processor is None else processor
        self._waits_over, self._waited_at_ns = 0, -1

    # --- frames

    def port(self, name: str, on_receive: Callable[[bytes], None] | None = None, *,
             listen_only: bool = False) -> Port:
        """Return the port on the medium `name`; raises UnknownName if the robot is on no such medium.

        The inbox passes each arriving frame to `on_receive`; without one it keeps the frame for `yield port.receive()`.
        `listen_only`, given before the run starts, says that no frame arriving here makes this program send a frame
        earlier than planned. The emulator then delivers such frames with the next grant, each at its own time.
        """
        port = self._node.ports[name]
        if on_receive is not None:
            port.on_receive = on_receive
        if listen_only:
            port.listen_only = True
        return port

    @property
    def ports(self) -> tuple[str, ...]:
        """The names of all ports, in the order of the scenario."""
        return tuple(self._node.ports)

    # --- time

    @property
    def now_ns(self) -> int:
        """The local time; within `record`, that of the sample."""
        return self._clock.now_ns()

    def at(self, local_ns: int, action: Callable[[], object], *, sends: bool = True) -> Timer:
        """Call `action` when the clock reads at least `local_ns`, at once if it does already; `cancel()` withdraws it.

        With `sends=False` the program says that the action sends no frame and causes none before the other timers do.
        """
        return Timer(self._timers, local_ns, action, sends)

    def every(self, period_ns: int, action: Callable[[], object], *, offset_ns: int = 0,
              sends: bool = True) -> Repetition:
        """Call `action` at `offset_ns`, `offset_ns + period_ns`, ... of local time, from now on; `sends` as in `at`.

        Raises ValueError for a period of less than 1 ns or a negative offset.
        """
        return Repetition(self._timers, period_ns, action, offset_ns, sends)

    def after(self, delay_ns: int, action: Callable[[], object], *, sends: bool = True) -> None:
        """Call `action` after `delay_ns` by another clock than this robot's: the interrupt of a radio or a UART."""
        self._timers.after(delay_ns, action, sends)

    def sleep_until(self, local_ns: int, *, silent_until_ns: int | None = None) -> Generator[Event, Any, None]:
        """Wait, by `yield from`, until the clock reads at least `local_ns`, also if the clock is changed meanwhile.

        The program promises to send nothing before it wakes or, if given, before a later `silent_until_ns`.
        """
        if self._clock.now_ns() >= local_ns:
            self._count_past_wait(local_ns)
            return
        yield self._timers.until(local_ns, silent_until_ns)
        while self._clock.now_ns() < local_ns:
            yield self._timers.until(local_ns, silent_until_ns)

    def until(self, local_ns: int, *, silent_until_ns: int | None = None) -> Timeout:
        """Return a SimPy event at the instant at which the clock, with its present rate and offset, reads `local_ns`.

        For `yield port.receive() | board.until(local_ns)`, and for a hardware timer that no step of the clock moves.
        The event occurs at once if the clock reads `local_ns` or more already.
        """
        return self._timers.until(local_ns, silent_until_ns)

    def start(self, process: Generator[Event, Any, Any]) -> Process:
        """Run one more generator of this program, from now on."""
        started = self._node.start(process)
        self._timers.note_start(started)
        return started

    def adjust_clock(self, step_ns: int = 0, trim_ppm: float = 0.0) -> None:
        """Synchronize the clock: set it forward by `step_ns` and let it run `trim_ppm` faster from now on.

        Earlier promises hold in true time, so a program adjusts the clock first and sets timers afterwards.
        """
        self._clock.adjust(step_ns)
        self._clock.trim(trim_ppm)

    def execution_ns(self, nominal_ns: int) -> int:
        """Return how long [ns] a task takes that takes `nominal_ns` while no fault slows the processor down."""
        return self._processor.execution_ns(nominal_ns)

    def promise_firm(self, local_ns: int) -> None:
        """Promise to send nothing before `local_ns`, whatever arrives; extends the promise of the timers."""
        self._node.promise_firm(self._clock.true_at(local_ns))

    def promise_soft(self, local_ns: int) -> None:
        """Promise to send nothing before `local_ns` unless a frame arrives; extends the promise of the timers."""
        self._node.promise_soft(self._clock.true_at(local_ns))

    # --- the plant

    def sense(self, variable: str) -> Any:
        """Return the plant's variable at the present: float, int, bool or str by type; of an array a tuple, rows first.

        Raises NoPlant without a plant, PlantError for an unknown variable.
        """
        return self._required_plant().get(variable)

    def actuate(self, variable: str, value: Any) -> None:
        """Set an input of the plant from now on; an array as a sequence of rows."""
        self._required_plant().set(variable, value)

    def sensors(self, variables: Sequence[str], units: Sequence[str | None] | None = None) -> OutputGroup:
        """Return variables to be read together, fast, by `.read()`; PlantError if `units` are not the FMU's."""
        return self._required_plant().output_group(variables, units)

    def actuators(self, variables: Sequence[str], units: Sequence[str | None] | None = None) -> InputGroup:
        """Return inputs to be set together, fast, by `.write(values)`; PlantError if `units` are not the FMU's."""
        return self._required_plant().input_group(variables, units)

    def event_plant(self) -> EventPlant:
        """Return the plant of a program whose class says `handles_events = True`; raises NoPlant without one."""
        plant = self._required_plant()
        if not isinstance(plant, EventPlant):
            raise TypeError(f"{self.name}: the events of its plant are not handled by its program: set "
                            "`handles_events = True` in the class of the program")
        return plant

    # --- the records

    def count(self, name: str, by: int = 1) -> None:
        """Add `by` to the counter `name`, "count.ROBOT.name" in [expect]; 0 makes the counter exist."""
        self._node.count(name, by)

    def record(self, signal: str, unit: str, read: Callable[[], Any]) -> None:
        """Record `read()` at every sample instant of the scenario, as the signal `ROBOT.signal`."""
        self._node.signals([(signal, unit)], lambda: (read(),))

    def record_all(self, signals_and_units: Sequence[tuple[str, str]], read: Callable[[], Sequence[float]]) -> None:
        """Record several signals; `read()` returns all their values."""
        self._node.signals(signals_and_units, read)

    def event(self, kind: str, detail: str = "", level: Level = Level.INFO) -> None:
        """Record an event at the present time, of severity `level`."""
        self._node.event(kind, detail, level)

    def warn(self, kind: str, detail: str = "") -> None:
        """Record an event that the summary and the report show as a warning."""
        self._node.warn(kind, detail)

    def parameter(self, name: str) -> Any:
        """Return an entry of this robot's `parameters` in the scenario, times in ns; UnknownName if it is missing."""
        return self._parameters[name]

    def at_end(self, action: Callable[[], object]) -> None:
        """Call `action` when this robot's program ends, with the run or by a kill: close a socket, a device."""
        self._node.at_end(action)

    # --- for emulated hardware and the code that builds the node; no program reads true time

    def present_ns(self) -> int:
        """Return the true time, that of an oscillator without error, on which an emulated processor runs."""
        return self._node.present_ns()

    def hold_time_outs(self, hold: bool) -> None:
        """Let the run's time-outs stand still, as a debugger does while the program does, or go on."""
        self.call_record.hold_word[0] = int(hold)

    def end_run(self, because: str) -> None:
        """End the whole run now, for a reason that is no failure."""
        self._node.end_run(because, self._node.present_ns())
        self._timers.after(0, _nothing, True)           # so that the emulator asks this node now

    def clock_reading(self) -> Callable[[], int]:
        """Return a function that returns `now_ns`, for a program that asks often."""
        return self._clock.now_ns

    def before_counters(self, action: Callable[[], object]) -> None:
        """Call `action` before the counters are read at the end of the run, for those that need no count in between."""
        self._node.before_counters(action)

    @property
    def slowness(self) -> float:
        """The factor by which faults slow the processor down, 1 without."""
        return self._processor.slowness

    def when_slowed(self, action: Callable[[], object]) -> None:
        """Call `action` whenever `slowness` changes."""
        self._processor.on_change = action

    def keep_promises(self) -> None:
        """Make the node take its promise from the timers of this board."""
        self._node.next_frame_ns = self._timers.next_frame_ns

    def take_faults(self, also: Sequence[LocalClock] = ()) -> None:
        """Let faults of the clock act on this board's timers from now on, and a change of its drift on those in `also`.

        Those are other counters of the same oscillator, which faults of an earlier life may have changed already.
        """
        self._same_oscillator = (self._clock, *also)
        for clock in also:
            clock.drift(self._clock.fault_ppm)
        self._node.at_fault("clock_step", self._step_clock)
        self._node.at_fault("clock_drift", self._trim_clock)

    def _step_clock(self, fields: Mapping[str, Any]) -> None:
        self._timers.change_clock(partial(self._clock.adjust, fields["by_ns"]))

    def _trim_clock(self, fields: Mapping[str, Any]) -> None:
        self._timers.change_clock(partial(self._drift, fields["by_ppm"]))

    def _drift(self, ppm: float) -> None:
        for clock in self._same_oscillator:
            clock.drift(ppm)

    def _required_plant(self) -> Plant:
        if self._plant is None:
            raise NoPlant(f"{self.name} has no plant; give it one, as agents.{self.name}.plant = {{ fmu = \"...\" }}; "
                          "`marconet fmu list` names some")
        return self._plant

    def _count_past_wait(self, local_ns: int) -> None:
        """Count waits for instants that have passed; RuntimeError for too many at one instant, a loop without end."""
        now_ns = self._node.env.time_ns()
        self._waits_over = self._waits_over + 1 if now_ns == self._waited_at_ns else 1
        self._waited_at_ns = now_ns
        if self._waits_over > MAX_WAITS_AT_ONE_INSTANT:
            raise RuntimeError(f"{MAX_WAITS_AT_ONE_INSTANT} waits in a row at {now_ns} ns for instants that had passed"
                               f", the last for {local_ns} ns of local time: no robot time passes; wait for later "
                               "ones, as with a period of more than 0")


def _nothing() -> None:
    """Do nothing, at the instant of a timer."""
