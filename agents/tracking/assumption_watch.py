"""Which assumptions of the trigger fail now: an event as one begins to fail, and one when it holds again.

    holds  --fails--> broken: counted, "assumption violated"  --holds--> "assumptions hold again"

A small-gain product that reaches one is told as a number too ("gain product"), for guarantees of the kind `reported`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Final, Protocol

from agents.triggering.assumptions import Assumption, Violation
from agents.triggering.policies.table import POLICIES

IN_TIME: Final = frozenset((Assumption.FRESH, Assumption.SMALL_GAIN, Assumption.LOSSES))


class NodeLike(Protocol):
    def count(self, counter: str) -> None: ...

    def event(self, kind: str, detail: str) -> None: ...

    def warn(self, kind: str, detail: str) -> None: ...


class AssumptionWatch:
    def __init__(self, node: NodeLike, policy: str) -> None:
        self._node = node
        self._measurable = POLICIES[policy].measurable
        self._broken: set[Assumption] = set()

    def fail(self, violations: Iterable[Violation]) -> None:
        """Told again, one that is broken already says nothing."""
        for violation in violations:
            if violation.assumption not in self._broken:
                self._broken.add(violation.assumption)
                self._node.count("violated assumptions")
                self._node.warn("assumption violated", str(violation))
                if violation.assumption is Assumption.SMALL_GAIN:
                    self._node.event("gain product", f"{violation.value:.6g}: {violation.text}")

    def hold(self, assumptions: Collection[Assumption]) -> None:
        """All of these hold now."""
        again = self._broken.intersection(assumptions)
        if again:
            self._broken -= again
            self._node.event("assumptions hold again", ", ".join(sorted(each.value for each in again)))

    def judge(self, violations: Iterable[Violation]) -> None:
        """`violations` is what a measurement shows; those that the policy does not care for are left out."""
        found = [violation for violation in violations if violation.assumption in self._measurable]
        self.hold(self._measurable.difference(violation.assumption for violation in found))
        self.fail(found)
