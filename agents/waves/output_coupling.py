"""How a robot uses plain outputs that it holds, for comparison with waves (`output_loop.py`).

    u_i = K sum_{j in N_i} (y^_j - y^_i)                (6.11), y^ the values sent last

It uses its own value at once, or as late as the latest of its neighbours'. At the start it knows every y(0).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from agents.waves.team import WaveTeam
from agents.waves.wave_frame import WaveFrame
from firmware_sim.board import Board


class OutputCoupling:
    def __init__(self, board: Board, team: WaveTeam, number: int, apply: Callable[[], None]) -> None:
        self._board, self._gain, self._apply = board, team.damping, apply
        self._newest = dict.fromkeys(team.neighbours[number], -1)
        self._held = {j: team.first_output(j) for j in team.neighbours[number]}
        self._own = team.first_output(number)
        self._own_late_ns = team.own_late_ns[number] if team.own_value == "late" and team.own_late_ns else 0
        self._measure = board.sensors(["y[1]"])

    def speak(self) -> list[float]:
        y = float(self._measure.read()[0])
        if self._own_late_ns:
            self._board.after(self._own_late_ns, partial(self._use_own, y), sends=False)
        else:
            self._use_own(y)
        return [y]

    def hear(self, frame: WaveFrame) -> None:
        if frame.sender not in self._held:
            return
        if frame.slot <= self._newest[frame.sender]:
            self._board.count("old frames")
            return
        self._newest[frame.sender], self._held[frame.sender] = frame.slot, frame.values[0]
        self._apply()

    def control(self) -> float:
        return self._gain * sum(held - self._own for held in self._held.values())

    def _use_own(self, y: float) -> None:
        self._own = y
        self._apply()
