"""One robot of a team that synchronizes its outputs by slotted broadcasts (Chapter 6), as it runs on the robot.

    its slot:        measure y_i, broadcast it, hold it                                        (6.11), Protocol 1
                     with an observer: correct it, broadcast the observed output instead       Remark 6
                     with models: broadcast the observed state                                 section 4.7
    a sync frame:    hold the sender's output, compute u_i anew
    a round's end:   adopt a new topology, if there is one: new parts, new slot length, new neighbours

All times are on the local clock. The robot sends in its own data slots, and in its own control sub-slots if its
topology source requires it; its promise to be silent until then is firm. It holds its own new value only from the
end of its frame and the receive latency on, when the others can have received it; with `own_value = "late"` in the
team's table only after the delays as well that impairments add to its values on their way to a robot that uses them.

Plant: inputs u[1..], outputs y[1..] as `linear_system` has them. The disturbance omega_i of (6.6) adds to u_i.
Not modelled: computing time (outputs appear at the slot's instant).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Final

from agents.synchronization.age_watch import AgeWatch
from agents.synchronization.agreement_law import AgreementLaw
from agents.synchronization.discovered_topology import DiscoveredTopology
from agents.synchronization.graph import Floats, neighbours
from agents.synchronization.in_step import InStep
from agents.synchronization.measurement_noise import NOISES, MeasurementNoise
from agents.synchronization.model_hold import Hold, ModelHold, control_instants_ns
from agents.synchronization.own_values import OwnValues
from agents.synchronization.round_plan import RoundPlan
from agents.synchronization.round_plans import RoundPlans
from agents.synchronization.sync_frame import SyncFrame, SyncFrameCodec
from agents.synchronization.team import SYNC_GAIN, read_team
from agents.synchronization.told_topology import ToldTopology
from agents.synchronization.topology_source import TopologySource
from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast
from firmware_sim.slot_sync import SlotSync

COUNTERS: Final = ("adoptions", "fallbacks", "unreadable frames", "values too old")


@dataclass(frozen=True)
class SyncSettings:
    """`disturbance`: omega_i as (from_s, value) pairs; the value is the same for all inputs.

    `measurement_noise`: level of the noise of y; `noise`: its distribution, one of `NOISES`."""

    disturbance: Sequence[Sequence[float]] = ()
    measurement_noise: float = 0.0
    noise: str = "uniform"

    def __post_init__(self) -> None:
        if not 0 <= self.measurement_noise < float("inf"):
            raise ValueError(f"measurement_noise={self.measurement_noise}: expected a level of 0 or more")
        if self.noise not in NOISES:
            raise ValueError(f'noise="{self.noise}": expected one of {", ".join(NOISES)}')


class SyncRobot:
    Settings: ClassVar = SyncSettings

    @staticmethod
    def check(scenario: ScenarioView, own: Own[SyncSettings]) -> Iterator[str]:
        """Yield every reason why these robots cannot synchronize over their medium."""
        from agents.synchronization.preparation import check  # late: a robot's process needs no impairments

        yield from check(scenario, own)

    @staticmethod
    def prepare(scenario: ScenarioView, own: Own[SyncSettings]) -> dict[str, Any]:
        """Return what the team table needs besides: frame times, and the round plan of each graph that will occur."""
        from agents.synchronization.preparation import prepare

        return prepare(scenario, own)

    def __init__(self, board: Board, settings: SyncSettings) -> None:
        team = read_team(board.team)
        self._board = board
        self._team = team
        self._number = team.names.index(board.name)
        self._port = board.port(board.ports[0], self._hear, listen_only=True)
        agent = team.agents[self._number]
        self._write_inputs = board.actuators([f"u[{k + 1}]" for k in range(agent.inputs)]).write
        outputs = board.sensors([f"y[{k + 1}]" for k in range(agent.outputs)])
        self._outputs = outputs.read
        level = settings.measurement_noise
        noise = MeasurementNoise(board.rng, settings.noise, level) if level else None
        self._own = OwnValues(outputs.read, noise, team.models[board.name], board.now_ns)
        self._law = AgreementLaw(self._number, agent.K, team.biases)
        self._omega = 0.0
        self._slot = 0                          # number of its next slot
        self._codec = SyncFrameCodec(len(team.names), team.values_per_frame)
        self._plans = RoundPlans(team)
        self._heard: set[int] = set()           # robots whose sync frames arrived since the last own slot
        self._own_delay_ns = team.own_delay_ns(self._number)
        guard_ns = round(team.guard_s * 1e9)
        self._sync = SlotSync(max(1, guard_ns // 2), SYNC_GAIN, far_ns=2 * guard_ns) if team.resynchronize else None
        self._in_step = InStep(2 * guard_ns, team.sync_contraction)
        self._counts_slots = team.topology == "told"    # so all robots number the slots of one schedule
        self._watch = AgeWatch(team.oldest_value_ns, round(team.guard_s * 1e9))
        self._watching = team.oldest_value_ns < 0 or not team.sure     # else `check` proved that no value is too old
        self._since_ns = 0                      # local time from which the schedule is in force
        self._source, plan = self._start_topology()
        self._models = self._start_models(plan)
        self._follow(plan, self._first_schedule(plan))
        for counter in COUNTERS:
            board.count(counter, 0)
        board.record_all([(f"y{suffix}", "1") for suffix in _suffixes(agent.outputs)]
                         + [(f"u{suffix}", "1") for suffix in _suffixes(agent.inputs)], self._sample)
        if self._own.observer is not None:
            observed = self._own.observer.output_at
            board.record_all([(f"observed{suffix}", "1") for suffix in _suffixes(agent.outputs)],
                             lambda: observed(board.now_ns))
        if team.every_output_known:
            for number, (model, other) in enumerate(zip(team.models.values(), team.agents, strict=True)):
                self._law.held[number] = tuple(float(value) for value in other.C @ (model.x0 or [0.0] * other.states))
        self._act: Callable[[], None] = self._begin
        board.at(board.now_ns, self._begin)
        for from_ns, value in disturbance_pieces(settings.disturbance):
            board.at(from_ns, partial(self._disturb, value), sends=False)

    # --- the program

    def _begin(self) -> None:
        self._apply()
        self._report_own_slots()
        self._plan()
        if self._models is not None:
            self._board.at(self._schedule.data_ns(0), self._control, sends=False)

    def _plan(self) -> None:
        """Arm a timer for the next own slot, control sub-slot or adoption, whichever is first."""
        source, schedule, now_ns = self._source, self._schedule, self._board.now_ns
        slot = self._slot
        first_ns = schedule.data_ns(slot)
        if first_ns < now_ns:               # the clock was set forward: this slot is over
            slot = self._slot = schedule.next_slot_of(self._part, now_ns - 1, slot - 1).number
            first_ns = schedule.data_ns(slot)
        self._act = self._speak
        if source.wants_control(schedule, now_ns):
            control = schedule.next_control_of(self._number, now_ns - 1, self._last_control).number
            control_ns = schedule.control_ns(control)
            if control_ns < first_ns:
                first_ns, self._act = control_ns, partial(self._discover, control)
        adoption_ns = source.adoption_ns(schedule, now_ns)
        if adoption_ns is not None and adoption_ns <= first_ns:
            first_ns, self._act = adoption_ns, partial(self._adopt, adoption_ns)
        self._board.at(first_ns, self._wake)

    def _wake(self) -> None:
        self._act()
        self._plan()

    def _speak(self) -> None:
        slot = self._slot
        self._slot = slot + self._schedule.parts
        self._source.before_own_slot(self._schedule, slot, self._heard)
        self._heard.clear()
        now_ns, count = self._board.now_ns, self._team.values_per_frame
        values = (self._own.measure(now_ns) if self._models is None else
                  self._own.measure_for(self._models, now_ns, count))
        self._port.send(self._codec.pack(self._number, slot, values))
        if self._own_delay_ns:
            self._board.after(self._own_delay_ns, partial(self._hold_own, values), sends=False)
        else:
            self._hold_own(values)
        if self._source.out_of_step():
            self._fall_back("somebody's control frame came in a slot that is not its own")
        if self._sync is not None:
            for kind, detail, level in self._in_step.close_round(self._sync.errors_ns.values()):
                self._board.event(kind, detail, level)
            correction = self._sync.close_round(self._schedule.round_ns)
            self._board.adjust_clock(correction.step_ns, correction.trim_ppm)

    def _discover(self, control: int) -> None:
        self._last_control = control
        frame = self._source.control_frame(self._schedule, self._board.now_ns)
        if frame is not None:
            self._port.send(frame)

    def _adopt(self, at_ns: int) -> None:
        """Adopt the topology source's topology at `at_ns`, the exact end of the round, on which all robots agree; the
        local clock may show it a tick later."""
        board = self._board
        laplacian = self._source.adopt(at_ns)
        if laplacian is None:
            self._fall_back("its discovery was incomplete")
            return
        plan = self._plans.plan(laplacian)
        if plan is None or plan.slot_ns < self._team.slot_needs_ns:
            why = "A_cl is not Hurwitz (Assumption 6)" if plan is None else (
                f"its slots of {plan.slot_ns} ns do not hold their frames ({self._team.slot_needs_ns} ns)")
            board.event("kept topology", f"{why} for {_links(laplacian)}")
            return
        schedule = SlottedBroadcast(len(plan.parts), plan.slot_ns, at_ns, self._schedule.guard_ns,
                                    self._schedule.agents, self._control_offset_ns(plan))
        self._watch.retire(self._schedule, self._part_of, self._since_ns, at_ns)
        self._since_ns = at_ns
        self._follow(plan, schedule)
        board.count("adoptions")
        board.event("adopted topology", _links(laplacian))
        self._report_own_slots()
        self._apply()

    def _fall_back(self, why: str) -> None:
        """Return to the slots of the start, since the robots may use different ones; `why` is for the record.

        The slots of the start lie on a grid from local time 0, the same for all. Neighbours and their values stay."""
        plan = self._plans.boot()
        self._watch.forget()
        self._since_ns = self._board.now_ns
        self._schedule = self._first_schedule(plan)
        self._part_of = dict(enumerate(range(len(self._team.names))))
        self._part = self._number
        now_ns = self._board.now_ns
        self._slot = self._schedule.next_slot_of(self._part, now_ns - 1).number
        self._last_control = -1
        self._heard.clear()
        self._source.fell_back()
        self._board.count("fallbacks")
        self._board.warn("fell back", f"to the slots of the start: {why}")

    def _disturb(self, value: float) -> None:
        self._omega = value
        self._drive()

    # --- receive

    def _hear(self, data: bytes) -> None:
        frame = self._codec.unpack(data)
        if frame is None:
            layout = self._team.layout
            sent_ns = self._board.now_ns - layout.control_airtime_ns - layout.latency_ns
            if not self._source.heard_control(data, self._schedule, sent_ns):
                self._board.count("unreadable frames")
            return
        sender = frame.sender
        if sender == self._number:
            self._board.count("unreadable frames")
            return
        if self._watching:
            self._check_age(frame)
        self._heard.add(sender)
        self._hold(sender, frame.values)
        if self._sync is not None:
            self._synchronize(frame)
        if sender in self._law.neighbours:
            self._apply()

    def _check_age(self, frame: SyncFrame) -> None:
        """Report a value older than a slot and than the delay with which the exact loop is stable.

        With discovered topologies every robot that is heard is a neighbour."""
        sender, now_ns, slot_ns = frame.sender, self._board.now_ns, self._schedule.slot_ns
        if self._team.topology == "told" and sender not in self._law.neighbours:
            return
        age_ns = self._watch.age_ns(sender, frame.slot, now_ns, self._schedule, self._part_of, self._since_ns)
        if age_ns is None or age_ns < max(slot_ns, self._judged_ns + 1):
            return
        self._board.count("values too old")
        if self._watch.is_news(sender, age_ns):
            bound = (f"less than {slot_ns} ns, the slot length" if self._judged_ns < slot_ns else
                     f"at most {self._judged_ns} ns, the delay with which its slots are stable")
            self._board.warn("assumption violated", f"age of information: {self._team.names[sender]}'s value is "
                                                    f"{age_ns} ns old when it comes: expected {bound}")

    def _report_own_slots(self) -> None:
        """Report a slot length chosen by the scenario's author that is longer than the certified one."""
        slot_ns, certified_ns = self._schedule.slot_ns, self._certified_ns
        if 0 < certified_ns < slot_ns:
            self._board.warn("assumption violated", f"slots of {slot_ns} ns, as team.slot_us says: expected at "
                                   f"most {certified_ns} ns, which (6.20) certifies")

    def _synchronize(self, frame: SyncFrame) -> None:
        assert self._sync is not None
        arrived_ns = self._board.now_ns
        layout = self._team.layout
        part = self._part_of[frame.sender]
        slot = self._schedule.nearest_slot_of(part, arrived_ns - layout.data_airtime_ns - layout.latency_ns).number
        if self._counts_slots and frame.slot % self._schedule.parts == part:
            slot = frame.slot           # a clock that was stepped may be off by rounds
        self._sync.heard(self._team.names[frame.sender], self._schedule.data_ns(slot), arrived_ns,
                         layout.data_airtime_ns, layout.latency_ns)

    # --- plant and control

    def _hold_own(self, values: tuple[float, ...]) -> None:
        self._hold(self._number, values)
        self._apply()

    def _hold(self, sender: int, values: tuple[float, ...]) -> None:
        if self._models is None:
            self._law.held[sender] = values
        else:
            self._models.take(self._board.now_ns, sender, values)

    def _control(self) -> None:
        """Renew the input at a control instant, and arm a timer for the next."""
        assert self._models is not None
        instants = len(self._control_instants_ns)
        self._models.control(self._board.now_ns, self._instant % instants == 0)
        self._apply()
        self._instant += 1
        slot, instant = divmod(self._instant, instants)
        self._board.at(self._schedule.data_ns(slot) + self._control_instants_ns[instant], self._control, sends=False)

    def _apply(self) -> None:
        if self._models is not None:
            self._law.held.update(self._models.outputs(self._board.now_ns))
        control = self._law.control()
        self._own.drive(self._board.now_ns, control)
        self._agreed = control
        self._drive()

    def _drive(self) -> None:
        """Set the plant's input: what the law says, and the disturbance."""
        control = self._agreed
        if self._omega:
            control = [u + self._omega for u in control]
        self._input = control
        self._write_inputs(control)

    def _sample(self) -> list[float]:
        return [*self._outputs(), *self._input]

    # --- schedules

    def _start_topology(self) -> tuple[TopologySource, RoundPlan]:
        team = self._team
        if team.topology == "told":
            requests = [(round(request.from_s * 1e9), team.laplacian_of(request.links)) for request in team.requests]
            plan = self._plans.plan(requests[0][1])
            if plan is None:
                raise ValueError(f"A_cl is not Hurwitz (Assumption 6) for {_links(requests[0][1])}")
            return ToldTopology(requests, round(team.repeat_s * 1e9)), plan
        source = DiscoveredTopology(self._board, self._number, len(team.names), team.max_successive_losses,
                                    team.oldest_value_ns)
        return source, self._plans.boot()

    def _start_models(self, plan: RoundPlan) -> ModelHold | None:
        team = self._team
        if team.hold is Hold.VALUE:
            return None
        self._control_instants_ns = control_instants_ns(plan.slot_ns, team.hold_steps, team.data_delay_ns)
        self._instant = 0                       # number of its next control instant, over all slots
        starts = [model.observer_start for model in team.models.values()]
        return ModelHold(self._number, team.agents, plan.laplacian, team.biases, team.hold, starts, team.data_delay_ns)

    def _first_schedule(self, plan: RoundPlan) -> SlottedBroadcast:
        offset_ns = self._control_offset_ns(plan)
        return SlottedBroadcast(len(plan.parts), plan.slot_ns, 0, round(self._team.guard_s * 1e9),
                                0 if offset_ns is None else len(self._team.names), offset_ns)

    def _control_offset_ns(self, plan: RoundPlan) -> int | None:
        """Return the start of the control sub-slot within a slot [ns]; None without discovery."""
        return self._team.layout.control_offset_ns(plan.slot_ns) if self._team.topology == "discovered" else None

    def _follow(self, plan: RoundPlan, schedule: SlottedBroadcast) -> None:
        self._law.listen_to(neighbours(plan.laplacian)[self._number], self._heard)
        self._heard.clear()
        self._part_of = {number: index for index, part in enumerate(plan.parts) for number in part}
        self._part = self._part_of[self._number]
        self._certified_ns = plan.certified_ns
        self._judged_ns = plan.assumed_ns + round(self._team.guard_s * 1e9) if plan.assumed_ns else 0
        self._schedule = schedule
        self._own.expect_rounds_of(plan.round_ns)
        self._slot = self._part                 # in the first round slot k belongs to part k
        self._last_control = -1


def disturbance_pieces(disturbance: Sequence[Sequence[float]]) -> list[tuple[int, float]]:
    """Return `disturbance` as (from_ns, value) pairs; ValueError unless pairs, ascending from 0 on."""
    if any(len(piece) != 2 for piece in disturbance):
        raise ValueError(f"disturbance={[list(piece) for piece in disturbance]}: expected pairs [from_s, value]")
    instants = [from_s for from_s, _ in disturbance]
    if instants != sorted(instants) or any(from_s < 0 for from_s in instants):
        raise ValueError(f"disturbance: from_s={instants}: expected ascending instants from 0 on")
    return [(round(from_s * 1e9), float(value)) for from_s, value in disturbance]


def _suffixes(count: int) -> list[str]:
    return [""] if count == 1 else [str(k + 1) for k in range(count)]


def _links(laplacian: Floats) -> str:
    """Return the links in words, robots numbered from 1 as in the dissertation."""
    return "; ".join(f"{i + 1} hears {','.join(str(j + 1) for j in heard) or 'nobody'}"
                     for i, heard in enumerate(neighbours(laplacian)))
