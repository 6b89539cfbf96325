"""The modes of a program as it runs: the present mode, and an event for each change.

    self._modes = Modes(board, automaton, "sensing", lambda: {"x": ..., "y": ...})
    self._modes.change("pursuing", "award of target 1", by="r2")

`Modes` records what the program does and refuses nothing: the records are judged after the run, by `checker`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from agents.hybrid.automaton import Automaton
from agents.hybrid.mode_change import KIND, START, ModeChange
from agents.hybrid.region import Point
from firmware_sim.board import Board


class Modes:
    def __init__(self, board: Board, automaton: Automaton, mode: str, read: Callable[[], Point]) -> None:
        """Record the start in `mode`; `read()` returns the present value of each variable of the automaton."""
        self._board, self._variables, self._inputs = board, tuple(automaton.variables), tuple(automaton.inputs)
        self._read = read
        self.mode = mode
        state = self._state()
        self._record(START, mode, state, state, {}, "", "start")

    def change(self, mode: str, cause: str, *, by: str = "", inputs: Mapping[str, float] | None = None,
               before: Point | None = None) -> None:
        """Change to `mode`, which may be the present one, and record the change.

        `by` names the node whose frame or sight caused it. If the program has reset its variables already, `before` is
        the state before that. Raises KeyError if a variable, or an input of the automaton that is needed, is missing.
        """
        reached = self._state()
        state = reached if before is None else {name: float(before[name]) for name in self._variables}
        given = inputs or {}
        self._record(self.mode, mode, state, reached,
                     {name: float(given[name]) for name in self._inputs if name in given}, by, cause)
        self.mode = mode

    def _state(self) -> dict[str, float]:
        found = self._read()
        return {name: float(found[name]) for name in self._variables}

    def _record(self, before: str, after: str, state: Point, reached: Point, inputs: Point, by: str,
                cause: str) -> None:
        self._board.event(KIND, ModeChange(0, self._board.name, before, after, state, reached, inputs, by,
                                           cause).detail())
