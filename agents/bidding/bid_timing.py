"""The times of the bidding protocol, and the bounds that follow from them.

S sensors own slots of length s in turn, so a sensor has one every round R = S s. A message that becomes due at t is in
the frames of the sender's next N^D + 1 slots, the last of which begins at t + (N^D + 1) R at the latest. A frame is at
its receivers within s, airtime and latency, and d, what links add. With at most N^D losses in a row on each link:

    delivery  D = (N^D + 1) R + s + d           from due until everybody has heard it
    window    W >= 2 D                          the opening BID reaches everybody within D, and the bids that answer it
                                                within D more: then all have the same bids when they close, and choose
                                                the same
    silence   L = (N^D + 1) H + 2 (s + d)       a sensor that is deployed sends at least every H, so one of its next
                                                N^D + 1 frames is heard within (N^D + 1) H + s + d; s + d more, since
                                                the sensors' windows close up to that much apart
    takeover  T = L + W + 2 (s + d)             from the death of a deployed sensor, or from the close of the window
                                                that it won, until another is deployed: its last frame may be under way
                                                for s + d, then L, a window, and the winner closes up to s + d later
    healing   (N^D + 1) H + s + d               from the end of a partition until that with the lower bid has let go

If not every sensor hears every other one, messages are flooded over up to h hops, one sensor passing them on to the
next; a hop takes as long as a delivery takes above, and each adds up to s + d to what windows close apart. With h = 1
these are the bounds above:

    hop       D1 = (N^D + 1) R + s + d
    delivery  D = h D1
    silence   L = (N^D + 1) H + (h - 1) D1 + (h + 1) (s + d)
    takeover  T = L + W + (h + 1) (s + d)       if those that are left hear each other over h hops
    healing   (N^D + 1) H + (h - 1) D1 + s + d

A winner that declines at the close, as it is needed elsewhere meanwhile, costs one more window and h (s + d).
Not modelled: a link cut for longer between two sensors that both hear the rest: each may deploy one.
"""

from __future__ import annotations

from dataclasses import dataclass

from agents.bidding.bid_frames import flooding_frame_bytes, frame_bytes


@dataclass(frozen=True, kw_only=True)
class BiddingSettings:
    """Parameters of every sensor of a team, and the same in all of them."""

    radio: str = "radio"                # name of the medium
    slot_ns: int                        # s
    window_ns: int                      # W, from the opening of a window to its close
    heartbeat_rounds: int = 4           # H / R
    max_successive_losses: int = 0      # N^D, on each link
    delay_ns: int = 0                   # d, the most that impairments delay a copy
    most_tasks: int = 3                 # tasks under way at a time, for the size of a frame
    most_hops: int = 1                  # h, from each sensor to each other one; 1: all hear each other

    def __post_init__(self) -> None:
        for name, least in (("slot_ns", 1), ("window_ns", 1), ("heartbeat_rounds", 1), ("max_successive_losses", 0),
                            ("delay_ns", 0), ("most_tasks", 1), ("most_hops", 1)):
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)}: expected at least {least}")


@dataclass(frozen=True)
class BidTiming:
    sensors: int
    settings: BiddingSettings

    @property
    def round_ns(self) -> int:
        return self.sensors * self.settings.slot_ns

    @property
    def frames(self) -> int:
        """The consecutive frames in which a message is repeated."""
        return self.settings.max_successive_losses + 1

    @property
    def transit_ns(self) -> int:
        """From the start of a slot until its frame is heard, at most."""
        return self.settings.slot_ns + self.settings.delay_ns

    @property
    def floods(self) -> bool:
        """True if messages are passed on from hop to hop."""
        return self.settings.most_hops > 1

    @property
    def hop_ns(self) -> int:
        """From due until all that hear the sender have heard it, at most."""
        return self.frames * self.round_ns + self.transit_ns

    @property
    def delivery_ns(self) -> int:
        return self.settings.most_hops * self.hop_ns

    @property
    def apart_ns(self) -> int:
        """The time [ns] by which two sensors close the same window apart, at most."""
        return self.settings.most_hops * self.transit_ns

    @property
    def later_hops_ns(self) -> int:
        return (self.settings.most_hops - 1) * self.hop_ns

    @property
    def least_window_ns(self) -> int:
        return 2 * self.delivery_ns

    @property
    def heartbeat_ns(self) -> int:
        return self.settings.heartbeat_rounds * self.round_ns

    @property
    def silence_ns(self) -> int:
        return self.frames * self.heartbeat_ns + self.later_hops_ns + self.transit_ns + self.apart_ns

    @property
    def takeover_ns(self) -> int:
        return self.silence_ns + self.settings.window_ns + self.transit_ns + self.apart_ns

    @property
    def healing_ns(self) -> int:
        return self.frames * self.heartbeat_ns + self.later_hops_ns + self.transit_ns

    @property
    def most_bytes(self) -> int:
        tasks = self.settings.most_tasks
        return flooding_frame_bytes(tasks, self.sensors) if self.floods else frame_bytes(tasks)

    def next_slot_ns(self, number: int, after_ns: int) -> int:
        """Return the start of the first slot of sensor `number` after `after_ns`, in local time."""
        own_ns = number * self.settings.slot_ns
        return own_ns + ((after_ns - own_ns) // self.round_ns + 1) * self.round_ns
