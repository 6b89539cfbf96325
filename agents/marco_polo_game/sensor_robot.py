"""A sensor of the Marco Polo game (Figure 2.3): a UGV or a UAV that detects, bids, investigates and pursues.

    a target comes into view     a detection, which all sensors are told of; one for each sensor and target counts
    k - 1 detections             a bid window for an investigation: the winner goes to an observation cell and stands
    k detections                 the investigation is over; a bid window of the UGVs for the pursuit
    a UGV within capture_m       grips the target, as it sees it, and has captured it when the target answers

Where a deployed sensor drives, and when it gives up, is its `guidance`: `Investigation`, and `PURSUIT` of the program.
A *stage* of a task is 2 a for an investigation and 2 a + 1 for a pursuit, a: attempts before it. Rewards are (2.4) as
`agents.marco_polo.reward` repairs it. A sensor that has detected the target itself does not bid for an investigation of
it, since a second detection by the same sensor is not independent.

Differs from the dissertation: Figure 2.3, line 44, offers UAVs for a pursuit, which the text forbids. Lines 22 and 28
both remove a captured target; here any UGV in range captures a target with k detections, and the target's answer says
which one did.
Not modelled: collisions of platforms that move, errors of a sensor's own place.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from math import dist
from typing import Any, ClassVar, Final

from agents.bidding.bid_frames import Detection as Shared
from agents.bidding.bid_frames import ModeMessage, Standing, Task
from agents.bidding.bidding import Bidding
from agents.hybrid.automaton import Automaton
from agents.hybrid.modes import Modes
from agents.marco_polo.connectivity import ConnectivityGraph
from agents.marco_polo.reward import Offer, Sensor, investigation_offer, pursuit_offer
from agents.marco_polo_game.drawn_ground import drawn_ground
from agents.marco_polo_game.game_table import game_of
from agents.marco_polo_game.grip_frames import Grip, Held, pack, unpack
from agents.marco_polo_game.guidance import Deck, Deployment, Guidance, MakesGuidance
from agents.marco_polo_game.investigation import Investigation
from agents.marco_polo_game.plain_pursuit import PlainPursuit
from agents.marco_polo_game.sensor_automaton import NOBODY, GameMode, sensor_automaton
from agents.marco_polo_game.sensor_check import game_problems
from agents.marco_polo_game.sensor_settings import SensorSettings
from agents.marco_polo_game.track import Seen, Track
from agents.pursuit import Place
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer
from firmware_sim.ground_plan import GroundPlan
from firmware_sim.scenario_view import Own, ScenarioView
from netem.media.sensing.sight import LOOK, Detection, unpack_sight
from netem.records.event_fields import Value, written

MOST_STAGE: Final = 254
COUNTERS: Final = ("detections", "investigations", "investigations without a detection", "pursuits",
                   "pursuits without a capture", "captures", "unreadable sights", "unreadable grips")


class Purpose(IntEnum):
    """The purpose for which the team deploys a sensor: the stage of the sensor's task modulo 2."""

    INVESTIGATION = 0
    PURSUIT = 1


class SensorRobot:
    """The program of both UGVs and UAVs; `CAPTURES`: it is one of a UGV, which pursues and captures targets."""

    Settings: ClassVar[type[SensorSettings]] = SensorSettings
    CAPTURES: ClassVar[bool]
    PURSUIT: ClassVar[MakesGuidance] = PlainPursuit

    @classmethod
    def check(cls, scenario: ScenarioView, own: Own[SensorSettings]) -> Iterator[str]:
        return game_problems(scenario, own, captures=cls.CAPTURES)

    @staticmethod
    def ground_plan(settings: SensorSettings, team: Mapping[str, Any]) -> GroundPlan:
        return drawn_ground(game_of(team))

    @classmethod
    def automaton(cls, settings: SensorSettings, team: Mapping[str, Any]) -> Automaton:
        game = game_of(team)
        speed_mps = game.parameters.ugv_mps if cls.CAPTURES else game.parameters.uav_mps
        return sensor_automaton(game, cls.CAPTURES, settings.platform.bounds(speed_mps))

    def __init__(self, board: Board, settings: SensorSettings) -> None:
        self._board, self._settings = board, settings
        game = self._game = game_of(board.team)
        self._parameters = game.parameters
        self._ground = game.ground(self.CAPTURES)
        self._mover = settings.platform.mover(board, game.area, game.speed_mps(board.name))
        self._tracks = [Track(game.area, game.parameters) for _ in game.targets]
        self._places: dict[str, Place] = {}                     # of the other sensors, as they told
        self._modes_told: dict[str, int] = {}                   # of the other sensors, numbers of `GameMode`
        self._attempts: dict[tuple[int, Purpose], int] = {}     # that are over
        self._task: Task | None = None                          # for which it is deployed
        self._timer: Timer | None = None                        # of the next plan
        self._offered: Offer | None = None                      # the last reward that the protocol asked for
        deck = Deck(board, settings, game, self._ground, self._graph, self._scanning)
        self._guidances: dict[Purpose, Guidance] = {Purpose.INVESTIGATION: Investigation(deck)}
        if self.CAPTURES:
            self._guidances[Purpose.PURSUIT] = self.PURSUIT(deck)
        self._view = board.port(settings.view, self._hear_view)
        self._grip = board.port(settings.grip, self._hear_grip) if self.CAPTURES else None
        self._modes = Modes(board, self.automaton(settings, board.team), GameMode.WAITING.word, self._state)
        self._bidding = Bidding(board, settings, reward=self._reward, deploy=self._deployed, let_go=self._let_go,
                                detected=self._told_detection, told_mode=self._told_mode,
                                whereabouts=lambda: (self._mode, *self._mover.place),
                                named=self._named, terms=lambda task: self._terms(self._offered))
        for counter in (*COUNTERS, *(f"detections of {target}" for target in game.targets)):
            board.count(counter, 0)
        board.record_all([("x", "m"), ("y", "m"), ("mode", "1"), ("target", "1"), ("coasted", "m")], self._sample)
        self._bidding.tell_mode()

    @property
    def _mode(self) -> GameMode:
        return GameMode[self._modes.mode.upper()]

    # --- detections

    def _hear_view(self, data: bytes) -> None:
        sight = unpack_sight(data)
        if sight is None:
            self._board.count("unreadable sights")
            return
        self._exposed(sight.exposed_ns)
        if isinstance(sight, Detection) and sight.name in self._game.targets:
            self._see(self._game.targets.index(sight.name), Seen(sight.exposed_ns, (sight.x_m, sight.y_m)))

    def _exposed(self, at_ns: int) -> None:
        """Note that the camera has exposed."""
        if self._task is not None:
            self._guidance.answered(at_ns)

    def _see(self, target: int, seen: Seen) -> None:
        track = self._tracks[target]
        last_ns = None if track.sight is None else track.sight.at_ns
        track.sight = Seen(seen.at_ns, self._game.area.nearest(seen.place))
        if last_ns is None or seen.at_ns - last_ns > self._settings.exposure_ns:      # it has come into view
            self._detect(target, track, seen)
        if track.detections >= self._parameters.detections and not track.captured:
            own = self._mover.place
            if self._grip is not None and dist(own, seen.place) <= self._parameters.capture_m:
                self._grip.send(pack(Grip(target, self._game.sensors.index(self._board.name), *own)))
        self._sighted(target, track, seen)
        self._tell_guidance(target, seen)

    def _sighted(self, target: int, track: Track, seen: Seen) -> None:
        """Do what a program adds at each sight of a target."""

    def _detect(self, target: int, track: Track, seen: Seen) -> None:
        if track.detected(self._board.name, seen):
            self._board.count("detections")
            self._board.count(f"detections of {self._game.targets[target]}")
            self._board.event("detection", written({"target": self._game.targets[target], "number": track.detections,
                                                    "x_m": seen.place[0], "y_m": seen.place[1]}))
        self._bidding.share(Shared(target, track.detections, seen.at_ns, *seen.place))
        self._demand(target, "")

    def _told_detection(self, origin: str, told: Shared, teller: str) -> None:
        """Take the detection of sensor `origin`, which the frame of sensor `teller` has brought here."""
        if told.target >= len(self._tracks):
            return
        track = self._tracks[told.target]
        if track.detected(origin, Seen(told.seen_ns, (told.x_m, told.y_m))) and self._board.name in track.seen:
            self._demand(told.target, teller)
        elif track.detections >= self._parameters.detections:
            self._stop_investigating(told.target, teller)
        self._tell_guidance(told.target, Seen(told.seen_ns, (told.x_m, told.y_m)))

    def _demand(self, target: int, by: str) -> None:
        """Ask for the sensor that the number of detections of a target asks for."""
        track, k = self._tracks[target], self._parameters.detections
        if track.captured:
            return
        if track.detections >= k:
            self._stop_investigating(target, by)
            if not track.investigated:
                track.investigated = True
                if (task := self._next(target, Purpose.INVESTIGATION)) is not None:
                    self._finish(task)
            self._open(target, Purpose.PURSUIT)
        elif track.detections == k - 1:
            self._open(target, Purpose.INVESTIGATION)

    def _open(self, target: int, purpose: Purpose) -> None:
        if (task := self._next(target, purpose)) is not None:
            self._bidding.open(task)

    def _next(self, target: int, purpose: Purpose) -> Task | None:
        """Return the task of the attempt that is not over; None after the last stage that a frame can name."""
        stage = 2 * self._attempts.get((target, purpose), 0) + purpose
        return Task(target, stage) if stage <= MOST_STAGE else None

    def _stop_investigating(self, target: int, by: str) -> None:
        """Wait again, if this sensor investigates a target that has k detections by now."""
        if self._mode is GameMode.INVESTIGATING and self._task is not None and self._task.target == target:
            task = self._task
            self._wait("k detections", by)
            self._finish(task)

    # --- bids

    def _reward(self, task: Task) -> float | None:
        offer = self._offered = self._offer(task)
        return None if offer is None else offer.reward

    def _named(self, task: Task) -> dict[str, Value]:
        """Return a task as named values of the records; a target that the team does not have by its number."""
        targets = self._game.targets
        return {"target": targets[task.target] if task.target < len(targets) else task.target,
                "for": Purpose(task.stage % 2).name.lower()}

    @staticmethod
    def _terms(offer: Offer | None) -> dict[str, Value]:
        """Return the terms of an offer as named values of the records."""
        return {} if offer is None else {"P_R": offer.detection, "gain": offer.coverage_gain,
                                         "way_m": offer.route.length_m}

    def _offer(self, task: Task) -> Offer | None:
        if self._mode is not GameMode.WAITING or task.target >= len(self._tracks):
            return None
        track, k = self._tracks[task.target], self._parameters.detections
        if track.captured or not track.seen:
            return None
        forecast, own = track.forecast(), self._mover.place
        others = [name for name in self._places if name != self._board.name]
        sensor = Sensor(own, self._game.radius_m[self._board.name],
                        [self._places[name] for name in others],
                        [self._game.radius_m[name] for name in others])
        if task.stage % 2 == Purpose.INVESTIGATION:
            if track.detections != k - 1 or self._board.name in track.seen:
                return None
            return investigation_offer(sensor, self._graph(), forecast.track, k, self._parameters.detection_threshold,
                                       self._parameters.investigation)
        if not self.CAPTURES or track.detections < k:
            return None
        return pursuit_offer(sensor, self._graph(), forecast.track, forecast.track.last, k, self._parameters.pursuit)

    def _graph(self) -> ConnectivityGraph:
        """Return the cells that this platform can occupy; UGVs are obstacles to each other."""
        return self._ground.graph(place for name, place in self._places.items()
                                  if self.CAPTURES and name in self._game.ugvs)

    def _scanning(self) -> list[str]:
        return [name for name, mode in self._modes_told.items() if mode != GameMode.PURSUING]

    def _deployed(self, task: Task, by: str) -> None:
        offer, track = self._offer(task), self._tracks[task.target]
        assert offer is not None                    # the protocol has just asked for the bid again
        before = self._state()
        self._task = task
        pursuit = task.stage % 2 == Purpose.PURSUIT
        mode = GameMode.PURSUING if pursuit else GameMode.INVESTIGATING
        self._board.count("pursuits" if pursuit else "investigations")
        self._modes.change(mode.word, written({"target": self._game.targets[task.target],
                                              **self._terms(offer), "bid": offer.reward}),
                           by="" if by == self._board.name else by, before=before,
                           inputs={"of": task.target, "detections": track.detections})
        self._guidance.begin(Deployment(task.target, track, offer, self._mover.place), self._board.now_ns)
        self._plan()

    # --- deployed

    def _pursues(self, target: int) -> bool:
        return self._mode is GameMode.PURSUING and self._task is not None and self._task.target == target

    @property
    def _guidance(self) -> Guidance:
        assert self._task is not None
        return self._guidances[Purpose(self._task.stage % 2)]

    def _tell_guidance(self, target: int, seen: Seen) -> None:
        if self._task is not None and self._task.target == target and self._guidance.saw(seen):
            self._plan()

    def _plan(self) -> None:
        """Drive as the guidance says until its next plan, or give the task up."""
        if self._timer is not None:
            self._timer.cancel()
        plan = self._guidance.plan(self._mover.place, self._board.now_ns)
        if plan is None:
            self._lost()
            return
        if plan.look:
            self._look("looks in pursuit")
        self._mover.go(plan.way)
        self._timer = self._board.at(plan.again_ns, self._plan)

    def _look(self, counter: str) -> None:
        """Request the next exposure of a camera that exposes on request."""
        self._view.send(LOOK)
        self._board.count(counter)

    def _lost(self) -> None:
        assert self._task is not None
        task = self._task
        pursuit = task.stage % 2 == Purpose.PURSUIT
        self._board.count("pursuits without a capture" if pursuit else "investigations without a detection")
        self._wait(self._guidance.lost, "")
        self._finish(task)
        if pursuit:
            self._look_after_others()

    def _hear_grip(self, data: bytes) -> None:
        frame = unpack(data)
        if frame is None or frame.target >= len(self._tracks) or frame.sensor >= len(self._game.sensors):
            self._board.count("unreadable grips")
        elif isinstance(frame, Held) and not self._tracks[frame.target].captured:
            self._captured(frame.target, self._game.sensors[frame.sensor])

    def _captured(self, target: int, captor: str) -> None:
        self._tracks[target].captured = True
        task = self._task if self._pursues(target) else None
        if captor == self._board.name:
            self._board.count("captures")
            x, y = self._mover.place if (sight := self._tracks[target].sight) is None else sight.place
            self._board.event("capture", written({"target": self._game.targets[target], "x_m": x, "y_m": y}))
            if task is None and (other := self._next(target, Purpose.PURSUIT)) is not None:
                self._finish(other)
        if task is not None:
            self._wait(f"captured by {captor}", self._game.targets[target])
            self._finish(task)
            self._look_after_others()

    # --- the end of a task

    def _wait(self, cause: str, by: str, given_up: bool = False) -> None:
        """Stand where it is, and wait for the next task."""
        assert self._task is not None
        track, now_ns, before = self._tracks[self._task.target], self._board.now_ns, self._state()
        guidance = self._guidance
        ends_ns = guidance.ends_ns
        guidance.end()
        self._task = None
        self._mover.stop()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._modes.change(GameMode.WAITING.word, cause, by=by, before=before, inputs={
            "detections": track.detections, "left_s": (ends_ns - now_ns) * 1e-9, "captured": float(track.captured),
            "given_up": float(given_up)})
        self._bidding.tell_mode()

    def _let_go(self, task: Task, by: str, why: str) -> None:
        if task == self._task:
            self._wait(why, by, given_up=True)

    def _finish(self, task: Task) -> None:
        """End a task for everybody."""
        self._over(task)
        self._bidding.finish(task)

    def _over(self, task: Task) -> None:
        """Note that an attempt at a target is over; the next one is a task of another stage."""
        key = task.target, Purpose(task.stage % 2)
        self._attempts[key] = max(self._attempts.get(key, 0), task.stage // 2 + 1)

    def _look_after_others(self) -> None:
        """Open windows for targets that may still be pursued, and for which no UGV was free."""
        for target, track in enumerate(self._tracks):
            if (track.detections >= self._parameters.detections and not track.captured
                    and track.forecast().leaves_ns > self._board.now_ns):
                self._open(target, Purpose.PURSUIT)

    def _told_mode(self, origin: str, message: ModeMessage, teller: str) -> None:
        self._places[origin], self._modes_told[origin] = (message.x_m, message.y_m), message.mode
        if message.standing is Standing.FINISHED and message.task.target < len(self._tracks):
            self._over(message.task)

    # --- records

    def _state(self) -> dict[str, float]:
        x, y = self._mover.place
        return {"x": x, "y": y, "target": NOBODY if self._task is None else float(self._task.target),
                "coasted": self._mover.coasted_m}

    def _sample(self) -> Sequence[float]:
        state = self._state()
        return [state["x"], state["y"], float(self._mode), state["target"], state["coasted"]]


class UavRobot(SensorRobot):
    CAPTURES = False


class UgvRobot(SensorRobot):
    CAPTURES = True
