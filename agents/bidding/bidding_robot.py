"""A sensor that stands and bids what its settings say: the protocol by itself, without plants and cameras.

    waiting --its bid was the greatest--> deployed --finished, or a greater bid is deployed--> waiting

It detects target k at `detects_ns[k]` (-1: never), shares the detection and opens a window for it. It bids `rewards[k]`
for target k, nothing for one without an entry, while it is deployed, or after it gave the task up. It finishes a task
`finishes_after_ns` after it was deployed, or gives it up after `gives_up_after_ns` (0: never).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from agents.bidding.bid_frames import Detection, ModeMessage, Task, as_sent
from agents.bidding.bid_timing import BiddingSettings
from agents.bidding.bidding import Bidding
from agents.bidding.bidding_check import bidding_problems
from agents.hybrid.automaton import Automaton, Edge, Mode
from agents.hybrid.modes import Modes
from agents.hybrid.region import EVERYWHERE, Between
from firmware_sim.board import Board

STAGE = 1       # of the only tasks


@dataclass(frozen=True, kw_only=True)
class BiddingRobotSettings(BiddingSettings):
    rewards: tuple[float, ...] = ()
    detects_ns: tuple[int, ...] = ()
    finishes_after_ns: int = 0
    gives_up_after_ns: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        for reward in self.rewards:
            as_sent(reward)


class BiddingRobot:
    Settings = BiddingRobotSettings
    check = staticmethod(bidding_problems)

    def __init__(self, board: Board, settings: BiddingRobotSettings) -> None:
        self._board, self._settings = board, settings
        self._targets = 0.0                     # for which it is deployed
        self._modes = Modes(board, self.automaton(settings, board.team), "waiting", lambda: {"targets": self._targets})
        self._bidding = Bidding(board, settings, reward=self._reward, deploy=self._deployed, let_go=self._waits,
                                detected=lambda origin, detection, teller: board.count("detections heard"),
                                told_mode=self._told_mode, whereabouts=lambda: (int(self._targets), 0.0, 0.0))
        for counter in ("detections heard", "modes heard", "deployed modes heard"):
            board.count(counter, 0)
        self._given_up: set[Task] = set()
        board.record("deployed", "1", lambda: self._targets)
        for target, at_ns in enumerate(settings.detects_ns):
            if at_ns > board.now_ns:
                board.at(at_ns, partial(self._detect, target))

    @staticmethod
    def automaton(settings: BiddingRobotSettings, team: Mapping[str, Any]) -> Automaton:
        return Automaton(
            modes={"waiting": Mode(Between("targets", 0, 0)), "deployed": Mode(Between("targets", 1, 1))},
            edges=[Edge("waiting", "deployed", reset={"targets": 1.0}), Edge("deployed", "waiting",
                                                                            reset={"targets": 0.0})],
            initial={"waiting": EVERYWHERE}, variables={"targets": "1"})

    def _detect(self, target: int) -> None:
        self._bidding.share(Detection(target, STAGE, self._board.now_ns, 0.0, 0.0))
        self._bidding.open(Task(target, STAGE))

    def _reward(self, task: Task) -> float | None:
        if self._targets or task in self._given_up or task.target >= len(self._settings.rewards):
            return None
        return self._settings.rewards[task.target]

    def _deployed(self, task: Task, by: str) -> None:
        self._change("deployed", 1.0, f"target {task.target}", by)
        if self._settings.finishes_after_ns:
            self._board.at(self._board.now_ns + self._settings.finishes_after_ns, partial(self._finish, task))
        if self._settings.gives_up_after_ns:
            self._board.at(self._board.now_ns + self._settings.gives_up_after_ns, partial(self._give_up, task))

    def _waits(self, task: Task, by: str, why: str) -> None:
        self._change("waiting", 0.0, why, by)

    def _finish(self, task: Task) -> None:
        if task in self._bidding.deployed_for():
            self._bidding.finish(task)
            self._change("waiting", 0.0, "finished", "")

    def _give_up(self, task: Task) -> None:
        self._given_up.add(task)
        self._bidding.give_up(task, "given up")

    def _told_mode(self, origin: str, message: ModeMessage, teller: str) -> None:
        self._board.count("deployed modes heard" if message.mode else "modes heard")

    def _change(self, mode: str, targets: float, cause: str, by: str) -> None:
        before, self._targets = {"targets": self._targets}, targets
        self._modes.change(mode, cause, by="" if by == self._board.name else by, before=before)
        self._bidding.tell_mode()
