"""A plant whose FMU has clocks: its events are handled here, at the instants at which its clocks tick.

    step mode --tick, or the FMU asks--> event mode: set clocks and clocked inputs, collect clocked outputs,
    update the discrete states until they are settled, ask for intervals --> step mode

Clocked binary outputs are collected in `outgoing` with their instant; `take_outgoing` hands them out. What the caller
gives for a clocked input acts in an event at the present. An FMU that returns early from a step, or asks for an event
at its end, gets event mode there.

*Invariants*
- after every call, `due_ns`, the next instant of an event, lies after `now_ns`;
- no step crosses `due_ns`.

Not supported: fixed steps, `calculated` clocks, saved states and so faults that kill the node.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from fmus.call_record import CallRecord
from fmus.description import PlantDescription, Variable
from fmus.errors import PlantError
from fmus.event_calls import CHANGED, UNCHANGED, EventFmu
from fmus.fmi_calls import Fmu
from fmus.parameters import Nested
from fmus.plant import HALF_NS, Plant
from fmus.timed_clock import TimedClock

MOST_ROUNDS = 1_000     # event iterations, or early returns, at one instant


class EventPlant(Plant):
    """Arguments are those of `Plant`; raises PlantError for an FMU without event mode or with fixed steps."""

    def __init__(self, description: PlantDescription, instance_name: str, start: Mapping[str, Nested] | None = None,
                 fixed_step_ns: int | None = None, logging: bool = True, present: Callable[[], int] | None = None,
                 on_end: Callable[[str, int], None] | None = None, record: CallRecord | None = None,
                 mortal: bool = False) -> None:
        where = f"{description.file}: {instance_name}"
        if not description.event_mode:
            raise PlantError(f"{where}: the FMU has no event mode (hasEventMode is not true), which clocks need: "
                             "export it with event mode")
        if mortal:
            raise PlantError(f"{where}: an FMU in event mode cannot outlive its node: leave out the faults that kill "
                             "or reboot it")
        super().__init__(description, instance_name, start, fixed_step_ns, logging, present, on_end, record)
        if self._grid is not None:
            raise PlantError(f"{where}: the FMU has a fixed step, between whose multiples its clocks could not tick: "
                             "export it with canHandleVariableCommunicationStepSize")
        fmu = self._fmu
        assert isinstance(fmu, EventFmu)
        self._events: EventFmu = fmu
        self.outgoing: list[tuple[int, str, bytes]] = []
        clocks = [variable for variable in description.variables.values() if variable.clock is not None]
        try:
            self._timed = [TimedClock(variable) for variable in clocks
                           if variable.causality == "input" and variable.clock is not None
                           and variable.clock.variability not in ("triggered", "calculated")]
        except ValueError as error:
            raise PlantError(f"{where}: {error}") from None
        self._triggered = [variable.reference for variable in clocks if variable.causality == "output"]
        self._clocked = [variable for variable in description.variables.values()
                         if variable.causality == "output" and variable.type == "Binary" and variable.clocks]
        self._at_s = 0.0                # communication point that the FMU has reached [s]
        self._own_ns: int | None = None     # event that the FMU itself has announced
        self.due_ns: int | None = None
        self._iterate([])

    def _instance(self, description: PlantDescription, name: str, logging: bool, record: CallRecord | None) -> Fmu:
        return EventFmu(description, name, logging, record)

    def advance_to(self, t_ns: int) -> None:
        """Step to `t_ns` through all events on the way, one at `t_ns` included."""
        if t_ns < self.now_ns:
            super().advance_to(t_ns)            # raises
        self.check_running()
        stuck = 0
        while True:
            due_ns = self.due_ns
            if due_ns is not None and due_ns <= self.now_ns:
                self._event([])
                continue
            target_ns = t_ns if due_ns is None or due_ns > t_ns else due_ns
            if target_ns == self.now_ns:
                return
            before_ns = self.now_ns
            self._step_towards(target_ns)
            stuck = stuck + 1 if self.now_ns == before_ns else 0
            if stuck > MOST_ROUNDS:
                self._stop(f"{MOST_ROUNDS} steps in a row returned early without progress")
                self.check_running()

    def deliver(self, clock: str, data: str, value: bytes) -> None:
        """Let the triggered input clock tick at the present, with `value` for the clocked binary input `data`."""
        self.come_to_present()
        self.check_running()
        description = self.description
        self._event([(description.variable(clock), description.variable(data), value)])

    def take_outgoing(self) -> list[tuple[int, str, bytes]]:
        """Return (time_ns, name, value) of the clocked binary outputs since the last call, none of them empty."""
        found, self.outgoing = self.outgoing, []
        return found

    def _step_towards(self, t_ns: int) -> None:
        """Make one step, which an early return may end before `t_ns`, and the event that it asks for."""
        step, end_s = self._step, t_ns / 1e9
        length_s = end_s - self._at_s
        if status := self._do_step(self._at_s, length_s):
            self._check_step(status, length_s, t_ns)
        if step.asks_to_end or (step.last < end_s - HALF_NS and not step.early):
            self._stopped_short(t_ns)
        if step.early and step.last < end_s - HALF_NS:
            self._at_s = max(self._at_s, step.last)
            self.now_ns = min(max(self.now_ns, round(self._at_s * 1e9)), t_ns)
        else:
            self._at_s, self.now_ns = end_s, t_ns
        if step.early or step.needs_event:
            self._event([])

    def _event(self, inputs: Sequence[tuple[Variable, Variable, bytes]]) -> None:
        """Handle an event at `now_ns`, in which `inputs` (clock, variable, value) and the clocks that are due tick."""
        self.check(self._events.enter_event_mode(), "entering event mode")
        self._iterate(inputs)

    def _iterate(self, inputs: Sequence[tuple[Variable, Variable, bytes]]) -> None:
        """Iterate in event mode until nothing is left to do at `now_ns`, and enter step mode."""
        fmu, now_ns = self._events, self.now_ns
        for _ in range(MOST_ROUNDS):
            due = [] if inputs else [clock for clock in self._timed if clock.due_ns is not None
                                     and clock.due_ns <= now_ns and clock.interval_s_known]
            ticking = [clock.variable.reference for clock in due] + [clock.reference for clock, _, _ in inputs]
            if ticking:
                self.check(fmu.tick(ticking), "activating clocks")
            for _, variable, value in inputs:
                self.check(fmu.set_elements(variable, [value]), f"setting {variable.name}")
            inputs = []
            again = self._settle(ticking)
            for clock in due:
                clock.ticked(now_ns)
            for clock in self._timed:
                if clock.may_change(clock in due):
                    self._ask(clock)
            if not again and not any(clock.due_ns is not None and clock.due_ns <= now_ns and clock.interval_s_known
                                     for clock in self._timed):
                break
        else:
            self._stop(f"the FMU is not done after {MOST_ROUNDS} event iterations at one instant")
            self.check_running()
        self.check(fmu.enter_step_mode(), "entering step mode")
        instants = [clock.due_ns for clock in self._timed if clock.due_ns is not None and clock.interval_s_known]
        if self._own_ns is not None:
            instants.append(self._own_ns)
        self.due_ns = min(instants, default=None)

    def _settle(self, ticking: Sequence[int]) -> bool:
        """Collect outputs and update the discrete states; return whether the FMU needs another iteration."""
        fmu = self._events
        self._collect(ticking)
        status, updated = fmu.update()
        self.check(status, "updating the discrete states")
        if updated.ends:
            self._end(self._at_s, self.now_ns)
        self._own_ns = None
        if updated.next_event_s is not None:
            self._own_ns = max(round(updated.next_event_s * 1e9), self.now_ns + 1)
        return updated.again

    def _collect(self, ticking: Sequence[int]) -> None:
        """Read the outputs whose clock ticks: an input clock in `ticking`, or an output clock that is active."""
        fmu, active = self._events, set(ticking)
        if self._triggered:
            status, found = fmu.ticking(self._triggered)
            self.check(status, "reading clocks")
            active.update(found)
        for variable in self._clocked:
            if not active.isdisjoint(variable.clocks):
                status, value = fmu.get_binary(variable)
                self.check(status, f"reading {variable.name}")
                if value:
                    self.outgoing.append((self.now_ns, variable.name, value))

    def _ask(self, clock: TimedClock) -> None:
        status, told = self._events.interval(clock.variable)
        self.check(status, f"reading the interval of {clock.variable.name}")
        again = told.qualifier == UNCHANGED and clock.due_ns is None and clock.variability == "changing"
        try:
            if told.qualifier == CHANGED:
                clock.told(told.interval_s, self.now_ns)
            elif again and clock.interval_s is not None:
                clock.told(clock.interval_s, self.now_ns)
        except ValueError as error:
            self._stop(str(error))
            self.check_running()
