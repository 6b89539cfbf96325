"""What a robot's program gets: its ports, timers on its own clock, its sensors and actuators, and its records.

    board.port(name)                        hands frames out, takes frames in
    board.at / every / sleep_until          act at an instant of the local clock
    board.sense / actuate                   read and drive the plant, at the present
    board.count / record / event / warn     what the records of the run say of this robot

All times are local: what this robot's clock shows. A timer is armed with the clock as it runs at that moment, as in a
microcontroller. After a step back the program waits on; after a step forward it acts late, by the step.

**The promise of silence** follows from the timers: this robot hands out nothing before the first of them that may lead
to a frame. The promise is firm if every port is `listen_only`. Otherwise a frame that arrives ends it, and a new one
follows; so a reply from `on_receive` breaks no promise. A timer that leads to no frame says so (`sends=False`,
`silent_until_ns`), and the emulator need not ask this robot earlier. A frame within the promise raises PromiseBroken.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from random import Random
from typing import Any, Final

from simpy.events import Event, Process, Timeout

from firmware_sim.board_timers import Repetition, Timer, Timers
from firmware_sim.local_clock import LocalClock
from firmware_sim.old_names import renamed
from fmus.plant import InputGroup, OutputGroup, Plant
from netem.node.node import Node, Port
from netem.wire.level import Level

MAX_WAITS_AT_ONE_INSTANT: Final = 100_000


class NoPlant(ValueError):
    """A program asks for a sensor or an actuator, and its robot has no plant."""


class Board:
    def __init__(self, node: Node, clock: LocalClock, plant: Plant | None, team: Mapping[str, Any], rng: Random,
                 parameters: Mapping[str, Any], clock_steps: Sequence[tuple[int, int]] = ()) -> None:
        """`team`: the scenario's table [team]; `clock_steps`: faults, (true_ns, delta_ns) in order."""
        self.name = node.name
        self.team = team
        self.rng = rng
        self._node, self._clock, self._plant, self._parameters = node, clock, plant, parameters
        self._timers = Timers(node, clock, clock_steps)
        self._waits_over, self._waited_at_ns = 0, -1

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(renamed(name))

    # --- frames

    def port(self, name: str, on_receive: Callable[[bytes], None] | None = None, *,
             listen_only: bool = False) -> Port:
        """The port on the medium `name`. Each frame that arrives is passed to `on_receive`; without one it waits for
        `yield port.receive()`.

        `listen_only`, said before the run starts: no frame that arrives here makes this program hand out a frame
        earlier than it has planned. The emulator then delivers such frames with the program's next turn, each acting
        at its own time. UnknownName if the robot is on no such medium.
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
        """Local time; within `record`, that of the sample."""
        return self._clock.now_ns()

    def at(self, local_ns: int, action: Callable[[], object], *, sends: bool = True) -> Timer:
        """Call `action` when the clock reads at least `local_ns`, at once if it does; `cancel()` withdraws it.

        Unless it `sends`, the action hands out no frame and leads to none before those that are planned otherwise.
        """
        return Timer(self._timers, local_ns, action, sends)

    def every(self, period_ns: int, action: Callable[[], object], *, offset_ns: int = 0,
              sends: bool = True) -> Repetition:
        """Call `action` at `offset_ns`, `offset_ns + period_ns`, ... of local time, from now on; `sends` as in `at`.

        ValueError for a period of less than 1 ns or a negative offset.
        """
        return Repetition(self._timers, period_ns, action, offset_ns, sends)

    def after(self, delay_ns: int, action: Callable[[], object], *, sends: bool = True) -> None:
        """Call `action` after `delay_ns` by another clock than this robot's: the interrupt of a radio or a UART."""
        self._timers.after(delay_ns, action, sends)

    def sleep_until(self, local_ns: int, *, silent_until_ns: int | None = None) -> Generator[Event, Any, None]:
        """`yield from` this: go on when the clock reads at least `local_ns`, whatever is done to it meanwhile.

        The program hands out nothing before it wakes. If it hands out nothing before a later `silent_until_ns` either,
        it says so here.
        """
        if self._clock.now_ns() >= local_ns:
            self._note_wait_that_is_over(local_ns)
            return
        yield self._timers.until(local_ns, silent_until_ns)
        while self._clock.now_ns() < local_ns:
            yield self._timers.until(local_ns, silent_until_ns)

    def until(self, local_ns: int, *, silent_until_ns: int | None = None) -> Timeout:
        """SimPy event at the instant at which the clock, as it runs now, reads `local_ns`; or at once.

        For `yield port.receive() | board.until(local_ns)`, and for a hardware timer that no step of the clock moves.
        """
        return self._timers.until(local_ns, silent_until_ns)

    def start(self, process: Generator[Event, Any, Any]) -> Process:
        """Run one more generator of this program, from now on."""
        return self._node.start(process)

    def adjust_clock(self, step_ns: int = 0, trim_ppm: float = 0.0) -> None:
        """Set the clock `step_ns` forward and let it run `trim_ppm` faster from now on: a synchronization.

        A promise that was given before stands in true time: adjust first, set timers afterwards.
        """
        self._clock.adjust(step_ns)
        self._clock.trim(trim_ppm)

    def promise_firm(self, local_ns: int) -> None:
        """Hand out nothing before `local_ns`, whatever is heard: beyond what the timers promise by themselves."""
        self._node.promise_firm(self._timers.no_later_than_a_step(self._clock.true_at(local_ns)))

    def promise_soft(self, local_ns: int) -> None:
        """Hand out nothing before `local_ns`, unless something is heard: beyond what the timers promise."""
        self._node.promise_soft(self._timers.no_later_than_a_step(self._clock.true_at(local_ns)))

    # --- the plant

    def sense(self, variable: str) -> Any:
        """The plant's variable at the present: float, int, bool or str by its type, a tuple for an array, rows first.

        NoPlant without a plant; PlantError names an unknown variable.
        """
        return self._body().get(variable)

    def actuate(self, variable: str, value: Any) -> None:
        """Set an input of the plant from now on; an array as a sequence of rows."""
        self._body().set(variable, value)

    def sensors(self, variables: Sequence[str], units: Sequence[str | None] | None = None) -> OutputGroup:
        """Variables that are read together, fast: `.read()` gives them at the present. `units` have to be the FMU's."""
        return self._body().output_group(variables, units)

    def actuators(self, variables: Sequence[str], units: Sequence[str | None] | None = None) -> InputGroup:
        """Inputs that are set together, fast: `.write(values)` sets them from now on."""
        return self._body().input_group(variables, units)

    # --- the records

    def count(self, name: str, by: int = 1) -> None:
        """Add `by` to the counter `name`: "count.ROBOT.name" in [expect]. With 0 it is there before it counts."""
        self._node.count(name, by)

    def record(self, signal: str, unit: str, read: Callable[[], float]) -> None:
        """Record `read()` at every sample instant of the scenario, as the signal `ROBOT.signal`."""
        self._node.signals([(signal, unit)], lambda: (read(),))

    def record_all(self, signals_and_units: Sequence[tuple[str, str]], read: Callable[[], Sequence[float]]) -> None:
        """Record several signals whose values `read()` gives together."""
        self._node.signals(signals_and_units, read)

    def event(self, kind: str, detail: str = "", level: Level = Level.INFO) -> None:
        """A line in the records of the run, with the time of now."""
        self._node.event(kind, detail, level)

    def warn(self, kind: str, detail: str = "") -> None:
        """An event that the summary and the report show as a warning."""
        self._node.warn(kind, detail)

    def parameter(self, name: str) -> Any:
        """What the scenario gives in this robot's `parameters`, times in ns; UnknownName if it is not there."""
        return self._parameters[name]

    # --- for the code that builds the node

    def keep_promises(self) -> None:
        """Let the node's promise follow from the timers of this board."""
        self._node.next_frame_ns = self._timers.next_frame_ns

    def _body(self) -> Plant:
        if self._plant is None:
            raise NoPlant(f"{self.name} has no plant; give it one, as agents.{self.name}.plant = {{ fmu = \"cart\" }}")
        return self._plant

    def _note_wait_that_is_over(self, local_ns: int) -> None:
        """RuntimeError for a program that waits again and again for instants that have passed: it would never end."""
        now_ns = self._node.env.time_ns()
        self._waits_over = self._waits_over + 1 if now_ns == self._waited_at_ns else 1
        self._waited_at_ns = now_ns
        if self._waits_over > MAX_WAITS_AT_ONE_INSTANT:
            raise RuntimeError(f"{MAX_WAITS_AT_ONE_INSTANT} waits in a row at {now_ns} ns for instants that had passed"
                               f", the last for {local_ns} ns of local time: no robot time passes; wait for later "
                               "ones, as with a period of more than 0")
