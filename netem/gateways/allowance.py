"""How much one peer may send: a token bucket, so that a peer that floods a gateway does not keep it from the others.

    credit grows by `per_s` a second up to `per_s`; each message or byte takes one
"""

from __future__ import annotations

from dataclasses import dataclass

NS_PER_S = 1_000_000_000


@dataclass
class Allowance:
    per_s: int                  # greatest rate, and what may come at once
    filled_ns: int              # instant at which the credit was last computed
    told: bool = False          # whether it has been told that the peer floods

    def __post_init__(self) -> None:
        self._credit = self.per_s * NS_PER_S        # in parts of 1e-9, so that no rounding adds up

    def take(self, now_ns: int, amount: int = 1) -> bool:
        """Take `amount` at `now_ns`; False, and nothing is taken, if it is not there."""
        self._credit = min(self._credit + (now_ns - self.filled_ns) * self.per_s, self.per_s * NS_PER_S)
        self.filled_ns = now_ns
        if self._credit < amount * NS_PER_S:
            return False
        self._credit -= amount * NS_PER_S
        return True

    def charge(self, amount: int) -> None:
        """Take `amount` though there may be less, so that the credit becomes negative."""
        self._credit -= amount * NS_PER_S

    def due_ns(self) -> int:
        """Return the first instant at which the credit is positive again."""
        return self.filled_ns if self._credit > 0 else self.filled_ns - self._credit // self.per_s + 1
