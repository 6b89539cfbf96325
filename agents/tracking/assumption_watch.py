"""Records an event when an assumption of the trigger begins to fail, and one when it holds again.

    holds  --fails--> broken: counted, "assumption violated"  --holds--> "assumptions hold again"

For a small-gain product of one or more the event "gain product" has its value, for guarantees of the kind `reported`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Final

from agents.triggering.assumptions import Assumption, Violation
from agents.triggering.policies.table import POLICIES
from firmware_sim.board import Board

IN_TIME: Final = frozenset((Assumption.FRESH, Assumption.SMALL_GAIN, Assumption.LOSSES))


class AssumptionWatch:
    def __init__(self, board: Board, policy: str) -> None:
        self._board = board
        self._measurable = POLICIES[policy].measurable
        self._broken: set[Assumption] = set()

    def fail(self, violations: Iterable[Violation]) -> None:
        """Record the violations of assumptions that held so far; one that is broken already is not recorded again."""
        for violation in violations:
            if violation.assumption not in self._broken:
                self._broken.add(violation.assumption)
                self._board.count("violated assumptions")
                self._board.warn("assumption violated", str(violation))
                if violation.assumption is Assumption.SMALL_GAIN:
                    self._board.event("gain product", f"{violation.value:.6g}: {violation.text}")

    def hold(self, assumptions: Collection[Assumption]) -> None:
        """Record that `assumptions` hold now, for those that were broken."""
        again = self._broken.intersection(assumptions)
        if again:
            self._broken -= again
            self._board.event("assumptions hold again", ", ".join(sorted(each.value for each in again)))

    def judge(self, violations: Iterable[Violation]) -> None:
        """Record the violations that a measurement shows, of those assumptions that the policy makes."""
        found = [violation for violation in violations if violation.assumption in self._measurable]
        self.hold(self._measurable.difference(violation.assumption for violation in found))
        self.fail(found)
