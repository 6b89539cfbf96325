"""When a lost connection is tried again: after `first_ns`, then after twice the time each, up to `longest_ns`.

    failed --first_ns--> try --failed, 2 first_ns--> try ... longest_ns --> try         succeeded: begins anew
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from netem.wire.instants import NEVER_NS


@dataclass
class Reconnection:
    """`due_ns` is the next attempt on the wall clock, NEVER_NS while connected; the first attempt is due at once."""

    first_ns: int
    longest_ns: int
    due_ns: int = 0
    told: bool = False          # whether the present failure has been told

    def __post_init__(self) -> None:
        self._wait_ns = self.first_ns

    def failed(self, now_ns: int) -> bool:
        """Plan the next attempt; return whether this failure is still to be told."""
        self.due_ns = now_ns + self._wait_ns
        self._wait_ns = min(2 * self._wait_ns, self.longest_ns)
        untold, self.told = not self.told, True
        return untold

    def under_way(self, until_ns: int = NEVER_NS) -> None:
        """Plan nothing before `until_ns`, as an attempt is under way or has succeeded."""
        self.due_ns = until_ns

    def succeeded(self) -> None:
        self.due_ns, self._wait_ns, self.told = NEVER_NS, self.first_ns, False

    def in_words(self) -> str:
        return (f"it is tried again after {self.first_ns * 1e-9:g} s, later every {self.longest_ns * 1e-9:g} s, and "
                "what the medium brings meanwhile is dropped and counted")


def wrong_times(retry_ns: int, retry_longest_ns: int) -> Iterator[str]:
    if retry_ns < 1_000_000:
        yield f"retry_ns={retry_ns}: expected at least 1 ms"
    elif retry_longest_ns < retry_ns:
        yield f"retry_longest_ns={retry_longest_ns}: expected at least retry_ns={retry_ns}"
