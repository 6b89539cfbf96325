"""The part of a sensor's program that bids: it owns the radio port, the windows and the repetitions.

    bidding = Bidding(board, settings, reward=..., deploy=..., let_go=...)
    bidding.open(Task(target, stage))          this sensor wants somebody deployed: opens a window
    bidding.finish(task)                       the task is over, for everybody
    bidding.share(Detection(...))               tell the others of a detection
    bidding.tell_mode()                         tell them that this sensor's mode has changed

`reward(task)` returns this sensor's bid, None for none; it is asked when a window opens, and again before this sensor
is deployed. `deploy(task, by)` and `let_go(task, by, why)` tell the program; `by` names the sensor that caused it.

The sensor sends in its own slots only (`bid_timing`), and no frame while nothing is due. While it is deployed, each of
its frames says so. With `most_hops` above 1 it passes messages on: the greatest bid that it knows of, whenever that bid
changes or the window closes earlier than the sensor knew; the end of a task, when the sensor learns of it; detections,
awards and modes by the rule of `flood`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

from agents.bidding.auction import Auction, Holder
from agents.bidding.bid_frames import (
    EPOCHS,
    MOST_SENSORS,
    NO_BID,
    NO_TASK,
    Award,
    Bid,
    Detection,
    Flooded,
    GreatestBid,
    Message,
    ModeMessage,
    Standing,
    Task,
    as_sent,
    head,
    newer,
    pack,
    stamp_us,
    unpack,
)
from agents.bidding.bid_timing import BiddingSettings, BidTiming
from agents.bidding.flood import Flood, key_of
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer
from netem.records.event_fields import Value, written

COUNTERS: Final = ("windows", "bids", "deployments", "let go", "awards acknowledged", "sensors silent",
                   "messages waiting", "unreadable frames")
Whereabouts = tuple[int, float, float]          # mode of the program, x, y [m]


@dataclass
class _Due:
    """A message for the next `frames` frames; `make` returns it as it is then, None if it is out of date."""

    make: Callable[[], Message | None]
    frames: int


class Bidding:
    def __init__(self, board: Board, settings: BiddingSettings, *, reward: Callable[[Task], float | None],
                 deploy: Callable[[Task, str], object], let_go: Callable[[Task, str, str], object],
                 detected: Callable[[str, Detection, str], object] = lambda origin, detection, teller: None,
                 told_mode: Callable[[str, ModeMessage, str], object] = lambda origin, message, teller: None,
                 whereabouts: Callable[[], Whereabouts] = lambda: (0, 0.0, 0.0),
                 named: Callable[[Task], Mapping[str, Value]] = lambda task: {"target": task.target},
                 terms: Callable[[Task], Mapping[str, Value]] = lambda task: {}) -> None:
        """`detected` and `told_mode` get what others tell; `whereabouts` is what this sensor tells of itself.

        A message comes from its `origin`, in a frame of `teller`: the same sensor, or the neighbour that passed it on.
        `named` returns what the records say of a task, beside its stage, and `terms` what they say of the bid for which
        `reward` was asked last, beside the bid.
        """
        self._names = sensors_of(board.team)
        self._board, self._number = board, self._names.index(board.name)
        self.timing = BidTiming(len(self._names), settings)
        self._reward, self._deploy, self._let_go = reward, deploy, let_go
        self._detected, self._told_mode, self._whereabouts = detected, told_mode, whereabouts
        self._named, self._terms = named, terms
        self._window_ns = settings.window_ns
        self._flood = Flood(self.timing.delivery_ns) if self.timing.floods else None
        self._auctions: dict[Task, Auction] = {}
        self._due: dict[tuple[object, ...], _Due] = {}
        self._slot: Timer | None = None                 # the next slot in which this sensor sends
        self._last_slot_ns = -1                         # the last one in which it did
        self._radio = board.port(settings.radio, self._hear)
        for counter in COUNTERS:
            board.count(counter, 0)

    # --- for the program

    def open(self, task: Task) -> None:
        """Open a window for the task, unless one is open, a sensor is deployed for it, or it is finished."""
        auction = self._auction(task)
        if auction.idle:
            self._open(auction)

    def finish(self, task: Task) -> None:
        """Tell everybody that the task is over for good; this sensor is no longer deployed for it.

        A later attempt at the same target is a task of another stage: who has missed the end of this one may still bid.
        """
        auction = self._auction(task)
        self._end(auction)
        self._say(auction, Standing.FINISHED)

    def give_up(self, task: Task, why: str) -> None:
        """Let the task go, though it is not over: the others open a window. Does nothing unless deployed for it."""
        auction = self._auction(task)
        if auction.own is not None:
            self._release(auction, self._number, why)
            self._open(auction)

    def share(self, detection: Detection) -> None:
        """Tell the others of a detection."""
        self._post(("D", detection.target, detection.number), self._flooded(lambda: detection))

    def tell_mode(self) -> None:
        """Tell the others this sensor's mode and where it is, as they are when the frame is sent."""
        self._post((Standing.FREE, NO_TASK), self._flooded(lambda: ModeMessage(
            (told := self._whereabouts())[0], Standing.FREE, NO_TASK, 0, 0.0, told[1], told[2])))

    def deployed_for(self) -> list[Task]:
        """Return the tasks for which this sensor is deployed."""
        return [auction.task for auction in self._auctions.values() if auction.own is not None]

    # --- a window

    def _open(self, auction: Auction) -> None:
        epoch = 0 if auction.epoch is None else (auction.epoch + 1) % EPOCHS
        self._begin(auction, epoch, self._board.now_ns + self._window_ns, self._number)

    def _begin(self, auction: Auction, epoch: int, closes_ns: int, opener: int) -> None:
        """Open the window that closes at `closes_ns` and of which `opener` has told; bid in it, or announce it."""
        auction.close()
        auction.holders.clear()
        auction.bids.clear()
        auction.epoch, auction.opener = epoch, opener
        wanted = self._reward(auction.task)
        reward = NO_BID if wanted is None else as_sent(wanted)
        auction.bids[self._number] = reward
        self._board.count("windows")
        self._board.event("window open", written({**self._told_of(auction), "by": self._names[opener],
                                                  "bid": "none" if reward == NO_BID else reward}))
        self._closes_at(auction, closes_ns)
        if reward > NO_BID:
            self._board.count("bids")
            self._board.event("bid", written({**self._told_of(auction), **self._terms(auction.task), "bid": reward}))
        if self._flood is not None:
            self._pass_on_bid(auction)
        elif reward > NO_BID or opener == self._number:
            self._post(("B", auction.task), partial(self._bid, auction, epoch, reward))

    def _closes_at(self, auction: Auction, closes_ns: int) -> None:
        if auction.close_timer is not None:
            auction.close_timer.cancel()
        auction.closes_ns = closes_ns
        auction.close_timer = self._board.at(closes_ns, partial(self._close, auction))

    def _bid(self, auction: Auction, epoch: int, reward: float) -> Message | None:
        if auction.closes_ns is None or auction.epoch != epoch:
            return None
        return Bid(auction.task, epoch, (auction.closes_ns - self._board.now_ns) // 1000, reward)

    def _pass_on_bid(self, auction: Auction) -> None:
        self._post(("B", auction.task), partial(self._greatest, auction, auction.epoch))

    def _greatest(self, auction: Auction, epoch: int | None) -> Message | None:
        if epoch is None or auction.closes_ns is None or auction.epoch != epoch:
            return None
        winner = auction.winner()
        bidder = self._number if winner is None else winner
        return GreatestBid(auction.task, epoch, bidder, (auction.closes_ns - self._board.now_ns) // 1000,
                           auction.bids[bidder])

    def _close(self, auction: Auction) -> None:
        auction.close()
        winner = auction.winner()
        if winner is None:
            self._board.warn("nobody bids", f"{_named(auction)}: the sensor heard no bid in the "
                             "window and has no bid itself")
        elif winner != self._number:
            self._hold(auction, winner, auction.bids[winner])
        elif self._reward(auction.task) is None:
            self._board.event("declined", _named(auction))
            self._open(auction)
        else:
            self._take(auction)

    def _take(self, auction: Auction) -> None:
        reward = auction.bids[self._number]
        auction.own = reward
        auction.heard_by.clear()
        self._board.count("deployments")
        self._board.event("deployed", written({**self._told_of(auction), "bid": reward}))
        epoch = auction.epoch
        self._post(("A", auction.task), self._flooded(
            lambda: None if auction.own is None or epoch is None else Award(auction.task, epoch, self._number, reward)))
        self._deploy(auction.task, self._names[auction.opener])

    # --- who is deployed

    def _hold(self, auction: Auction, number: int, reward: float) -> None:
        """Note that another sensor is deployed, or has to be by now, and watch that it goes on."""
        auction.holders[number] = Holder(reward, self._board.now_ns)
        if auction.watch_timer is None:
            self._watch_at(auction, self._board.now_ns + self.timing.silence_ns)

    def _watch_at(self, auction: Auction, local_ns: int) -> None:
        auction.watch_timer = self._board.at(local_ns, partial(self._watch, auction))

    def _watch(self, auction: Auction) -> None:
        auction.watch_timer = None
        for number in auction.silent_since(self._board.now_ns - self.timing.silence_ns):
            self._board.count("sensors silent")
            self._board.event("silent", f"{_named(auction)}: {self._names[number]}")
        if auction.holders:
            last_ns = max(holder.heard_ns for holder in auction.holders.values())
            self._watch_at(auction, last_ns + self.timing.silence_ns)
        elif auction.idle:
            self._open(auction)

    def _release(self, auction: Auction, by: int, why: str) -> None:
        auction.own = None
        self._board.count("let go")
        self._board.event("let go", written({**self._told_of(auction), "by": self._names[by], "why": why}))
        self._say(auction, Standing.LET_GO)
        self._let_go(auction.task, self._names[by], why)

    def _end(self, auction: Auction) -> None:
        auction.close()
        auction.holders.clear()
        auction.own, auction.finished = None, True
        if auction.epoch is None:
            auction.epoch = 0

    # --- what others tell

    def _hear(self, data: bytes) -> None:
        found = unpack(data, len(self._names))
        if found is None:
            self._board.count("unreadable frames")
            return
        sender, messages = found
        for message in messages:
            match message:
                case Bid():
                    self._hear_bid(self._auction(message.task), sender, message, sender)
                case GreatestBid(task, epoch, bidder, left_us, reward):
                    self._hear_greatest(self._auction(task), bidder, Bid(task, epoch, left_us, reward), sender)
                case Flooded(origin, _, flooded):
                    if origin != self._number and self._flood is not None and self._flood.is_new(
                            message, self._board.now_ns):
                        self._post(("R", *key_of(message)), partial(_itself, message))
                        self._take_in(origin, flooded, sender)
                case Detection() | Award() | ModeMessage():
                    self._take_in(sender, message, sender)

    def _take_in(self, origin: int, message: Detection | Award | ModeMessage, teller: int) -> None:
        """Take what `origin` tells, in a frame of `teller`, which is another sensor if the message is flooded."""
        match message:
            case Detection():
                self._detected(self._names[origin], message, self._names[teller])
            case Award(task, epoch, winner, reward):
                self._hear_deployed(self._auction(task), winner, epoch, reward, teller)
                if self._flood is None:
                    self._say(self._auction(task), Standing.HEARD, frames=1)
            case ModeMessage():
                if message.standing is not Standing.FREE:
                    self._hear_mode(self._auction(message.task), origin, message, teller)
                self._told_mode(self._names[origin], message, self._names[teller])

    def _hear_greatest(self, auction: Auction, bidder: int, bid: Bid, teller: int) -> None:
        """Take the greatest bid that a neighbour knows of, and pass on what is news to this sensor."""
        before = auction.epoch, auction.winner(), auction.closes_ns
        self._hear_bid(auction, bidder, bid, teller)
        if auction.closes_ns is not None and before != (auction.epoch, auction.winner(), auction.closes_ns):
            self._pass_on_bid(auction)

    def _hear_bid(self, auction: Auction, bidder: int, bid: Bid, teller: int) -> None:
        epoch, now_ns = auction.epoch, self._board.now_ns
        later = epoch is None or newer(bid.epoch, epoch)
        if auction.finished:
            self._say(auction, Standing.FINISHED)
        elif auction.own is not None:               # the sender has lost sight of this sensor
            if later:
                auction.epoch = bid.epoch
            self._say(auction, Standing.DEPLOYED)
        elif later or (bid.epoch == epoch and auction.closes_ns is not None):
            closes_ns = now_ns + bid.left_us * 1000
            if later:
                self._begin(auction, bid.epoch, closes_ns, teller)
            elif auction.closes_ns is not None and closes_ns < auction.closes_ns:
                self._closes_at(auction, closes_ns)
            if bidder != self._number:              # others may remember a bid of this sensor from before it booted
                auction.bids[bidder] = bid.reward

    def _hear_mode(self, auction: Auction, sender: int, message: ModeMessage, teller: int) -> None:
        match message.standing:
            case Standing.DEPLOYED:
                self._hear_deployed(auction, sender, message.epoch, message.reward, teller)
            case Standing.HEARD:
                if auction.own is not None and message.epoch == auction.epoch and sender not in auction.heard_by:
                    auction.heard_by.add(sender)
                    if len(auction.heard_by) == len(self._names) - 1:
                        self._board.count("awards acknowledged")
                        self._due.pop(("A", auction.task), None)       # all have heard it: repeat it no more
            case Standing.LET_GO:
                if auction.holders.pop(sender, None) is not None and auction.idle:
                    self._open(auction)
            case Standing.FINISHED:
                if not auction.finished:
                    was_deployed = auction.own is not None
                    self._end(auction)
                    if self._flood is not None:
                        self._say(auction, Standing.FINISHED)
                    if was_deployed:
                        self._let_go(auction.task, self._names[teller], "the task is over")

    def _hear_deployed(self, auction: Auction, number: int, epoch: int, reward: float, teller: int) -> None:
        """Take the news that sensor `number` is deployed: no window is needed, and of two the lower bid lets go."""
        if number == self._number:
            return                      # only this sensor tells that it is deployed
        if auction.finished:
            self._say(auction, Standing.FINISHED)
            return
        if auction.epoch is None or newer(epoch, auction.epoch):
            auction.epoch = epoch
        auction.close()
        known = number in auction.holders
        self._hold(auction, number, reward)
        if auction.own is None:
            return
        if not known:
            self._board.warn("two deployed", f"{_named(auction)}: {self._names[self._number]} with bid "
                             f"{_shown(auction.own)}, {self._names[number]} with bid {_shown(reward)}")
        if (reward, -number) > (auction.own, -self._number):
            self._release(auction, teller, f"{self._names[number]} is deployed with bid {_shown(reward)}, own bid "
                          f"{_shown(auction.own)}")
        elif not known:
            self._say(auction, Standing.DEPLOYED)

    # --- what this sensor tells

    def _say(self, auction: Auction, standing: Standing, frames: int = 0) -> None:
        """Tell where this sensor stands, in the next `frames` frames; 0: as many as a message is repeated in."""
        make = partial(self._mode, auction, standing)
        self._post((standing, auction.task), make if standing is Standing.FINISHED else self._flooded(make), frames)

    def _flooded(self, make: Callable[[], Detection | Award | ModeMessage | None]) -> Callable[[], Message | None]:
        """Return `make`, or a function whose messages are flooded, with the stamp of now."""
        if self._flood is None:
            return make
        stamp = stamp_us(self._board.now_ns)
        return lambda: None if (message := make()) is None else Flooded(self._number, stamp, message)

    def _mode(self, auction: Auction, standing: Standing) -> ModeMessage | None:
        if auction.epoch is None or (auction.own is None) == (standing is Standing.DEPLOYED):
            return None                 # it has changed since: deployed no more, or again
        mode, x_m, y_m = self._whereabouts()
        return ModeMessage(mode, standing, auction.task, auction.epoch, auction.own or 0.0, x_m, y_m)

    def _post(self, key: tuple[object, ...], make: Callable[[], Message | None], frames: int = 0) -> None:
        self._due[key] = _Due(make, frames or self.timing.frames)
        self._arm()

    def _arm(self) -> None:
        """Wake in the next own slot if anything is due, else for the next heartbeat of a deployed sensor."""
        now_ns = self._board.now_ns
        next_ns = self.timing.next_slot_ns(self._number, max(now_ns, self._last_slot_ns))
        if not self._due:
            if not self.deployed_for():
                return
            next_ns = max(next_ns, self._last_slot_ns + self.timing.heartbeat_ns)
        if self._slot is None or self._slot.local_ns > next_ns:
            if self._slot is not None:
                self._slot.cancel()
            self._slot = self._board.at(next_ns, self._send)

    def _send(self) -> None:
        assert self._slot is not None
        self._last_slot_ns, self._slot = self._slot.local_ns, None
        parts, room, said = [head(self._number)], self.timing.most_bytes, set()
        room -= len(parts[0])
        for key, due in list(self._due.items()):
            message = due.make()
            data = b"" if message is None else pack(message)
            if len(data) > room:
                self._board.count("messages waiting")
                continue
            due.frames = due.frames - 1 if data else 0
            if not due.frames:
                del self._due[key]
            if data:
                room -= len(data)
                parts.append(data)
                said.add(key)
        for task in self.deployed_for():
            if ("A", task) not in said and (Standing.DEPLOYED, task) not in said:
                message = self._flooded(partial(self._mode, self._auctions[task], Standing.DEPLOYED))()
                data = b"" if message is None else pack(message)
                if 0 < len(data) <= room:
                    room -= len(data)
                    parts.append(data)
        if len(parts) > 1:
            self._radio.send(b"".join(parts))
        self._arm()

    def _told_of(self, auction: Auction) -> dict[str, Value]:
        """Return a task and the epoch of its last window, as named values of the records."""
        return {**self._named(auction.task), "stage": auction.task.stage, "epoch": auction.epoch or 0}

    def _auction(self, task: Task) -> Auction:
        found = self._auctions.get(task)
        if found is None:
            found = self._auctions[task] = Auction(task)
        return found


def sensors_of(team: object) -> tuple[str, ...]:
    """Return the names of `team.sensors`, in the order of their numbers; ValueError if the list is missing or wrong."""
    names = team.get("sensors") if isinstance(team, dict) else None
    if not isinstance(names, list | tuple) or not 1 < len(names) <= MOST_SENSORS or not all(
            isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise ValueError(f"team.sensors={names}: expected 2 to {MOST_SENSORS} names, each once")
    return tuple(names)


def _itself(message: Message) -> Message:
    return message


def _named(auction: Auction) -> str:
    return f"target {auction.task.target} stage {auction.task.stage} epoch {auction.epoch}"


def _shown(reward: float) -> str:
    return "none" if reward == NO_BID else f"{reward:g}"
