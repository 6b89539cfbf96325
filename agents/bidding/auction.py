"""The state that a sensor keeps of one task: its bid window, the bids that it has heard, and who is deployed.

*Invariants*
- `closes_ns` is not None exactly while the window is open; then the sensor is not deployed;
- for a finished task no window is open, and no sensor is deployed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from agents.bidding.bid_frames import NO_BID, Task
from firmware_sim.board_timers import Timer


class Holder(NamedTuple):
    """A sensor that is deployed, or was chosen, with its bid and when it was heard last, in local time."""

    reward: float
    heard_ns: int


@dataclass
class Auction:
    task: Task
    epoch: int | None = None                    # of the last window; None before the first
    opener: int = 0                             # the sensor by which this one learned of the window
    closes_ns: int | None = None                # local time
    bids: dict[int, float] = field(default_factory=dict)
    holders: dict[int, Holder] = field(default_factory=dict)        # other sensors
    own: float | None = None                    # the bid by which this sensor is deployed
    finished: bool = False
    heard_by: set[int] = field(default_factory=set)         # who has acknowledged this sensor's award
    close_timer: Timer | None = None
    watch_timer: Timer | None = None

    @property
    def idle(self) -> bool:
        """True if the task is not over, and this sensor knows of no open window and no deployed sensor."""
        return not self.finished and self.closes_ns is None and self.own is None and not self.holders

    def winner(self) -> int | None:
        """Return the number of the sensor with the greatest bid, the lowest of equal ones; None without a bid."""
        bids = {number: reward for number, reward in self.bids.items() if reward > NO_BID}
        return max(bids, key=lambda number: (bids[number], -number), default=None)

    def close(self) -> None:
        """Close the window, if it is open."""
        self.closes_ns = None
        if self.close_timer is not None:
            self.close_timer.cancel()
            self.close_timer = None

    def silent_since(self, heard_before_ns: int) -> list[int]:
        """Remove and return the holders that were not heard after that instant."""
        silent = [number for number, holder in self.holders.items() if holder.heard_ns <= heard_before_ns]
        for number in silent:
            del self.holders[number]
        return silent
