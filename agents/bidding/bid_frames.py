"""The frame of the bidding protocol, little endian: a head, then messages until its end.

    head        0xB1, sender                                                               2 bytes
    detection   'D', target, number, seen [ns], x, y [m]                              1+1+1+8+4+4 = 19
    bid         'B', target, stage, epoch, time left of the window [us], reward      1+1+1+1+4+4 = 12
    award       'A', target, stage, epoch, winner, reward                              1+1+1+1+1+4 = 9
    mode        'M', mode, standing, target, stage, epoch, reward, x, y [m]    1+1+1+1+1+1+4+4+4 = 18
    greatest    'G', target, stage, epoch, bidder, time left [us], reward          1+1+1+1+1+4+4 = 13
    flooded     'R', origin, stamp [us]; followed by the detection, award or mode that is flooded    1+1+4 = 6

A task is a target and a stage, such as its number of detections so far; an epoch counts the windows that were opened
for a task, modulo 256. A bid of -inf opens a window and takes no part. A sender repeats a message in consecutive
frames, all of which it sends in its own slots: so N^D losses in a row cannot lose all copies of one message, as they
could if each message had frames of its own between those of others.
With `most_hops` above 1 a sensor sends the greatest bid that it knows of, its own or another's, and floods its other
messages: a sensor that hears one with a stamp newer than the last passes it on unchanged. A stamp is local time of the
origin.
Parsing never raises: it returns None for a frame that is cut, too long, or holds a number that cannot be.
Not modelled: a checksum; the radio has one.
"""

from __future__ import annotations

import struct
from enum import IntEnum
from math import inf, isfinite
from typing import Final, NamedTuple

MAGIC: Final = 0xB1
MOST_SENSORS: Final = 254
EPOCHS: Final = 256
NO_BID: Final = -inf
_HEAD, _DETECTION, _BID, _AWARD, _MODE, _GREATEST, _FLOODED = (struct.Struct(form) for form in (
    "<BB", "<cBBqff", "<cBBBIf", "<cBBBBf", "<cBBBBBfff", "<cBBBBIf", "<cBI"))
_REWARD: Final = struct.Struct("<f")
_MOST_US: Final = (1 << 32) - 1


class Task(NamedTuple):
    target: int
    stage: int


NO_TASK: Final = Task(255, 255)
OUT_OF_VIEW: Final = 0      # number of a detection: the sender sees the target no more; x, y are the sender's place


class Standing(IntEnum):
    """The part that the sender of a MODE message has in the task."""

    DEPLOYED = 0        # it is deployed for the task
    HEARD = 1           # it has heard the award of the task
    LET_GO = 2          # it was deployed and is no longer, the task goes on
    FINISHED = 3        # the task is over: captured, or out of reach
    FREE = 4            # nothing of a task, only its mode and where it is: `NO_TASK`


class Detection(NamedTuple):
    target: int
    number: int         # of detections of this target so far, as the sender knows; or OUT_OF_VIEW
    seen_ns: int
    x_m: float
    y_m: float


class Bid(NamedTuple):
    task: Task
    epoch: int
    left_us: int
    reward: float


class Award(NamedTuple):
    task: Task
    epoch: int
    winner: int
    reward: float


class ModeMessage(NamedTuple):
    mode: int           # of the sender's program, a number that the program chooses
    standing: Standing
    task: Task
    epoch: int
    reward: float       # of the bid by which it was deployed; 0 if it is not
    x_m: float
    y_m: float


class GreatestBid(NamedTuple):
    """The greatest bid of a window that the sender knows of; -inf: it knows of none."""

    task: Task
    epoch: int
    bidder: int
    left_us: int
    reward: float


class Flooded(NamedTuple):
    """A message that is passed on from hop to hop, with the sensor that it comes from."""

    origin: int
    stamp_us: int       # of the origin's local time, modulo `STAMPS`
    message: Detection | Award | ModeMessage


Message = Detection | Bid | Award | ModeMessage | GreatestBid | Flooded
PER_TASK_BYTES: Final = _DETECTION.size + _BID.size + _MODE.size      # most of one task that are due at a time
MODES_PER_TASK: Final = 3               # own one, and those of two other sensors that are, or were, deployed
STAMPS: Final = 1 << 32


def frame_bytes(tasks: int) -> int:
    """Return the size of a frame with the sender's mode and all that is due while so many tasks are under way."""
    return _HEAD.size + _MODE.size + tasks * PER_TASK_BYTES


def flooding_frame_bytes(tasks: int, sensors: int) -> int:
    """Return the same for a team of `sensors` that flood: all modes, and for each task a detection of each sensor."""
    mode = _FLOODED.size + _MODE.size
    of_task = sensors * (_FLOODED.size + _DETECTION.size) + _GREATEST.size + MODES_PER_TASK * mode
    return _HEAD.size + sensors * mode + tasks * of_task


def as_sent(reward: float) -> float:
    """Return a reward as a frame carries it, in single precision; ValueError if it is not finite or too large."""
    try:
        sent: float = _REWARD.unpack(_REWARD.pack(reward))[0]
    except OverflowError:
        sent = inf
    if not isfinite(sent):
        raise ValueError(f"reward={reward}: expected a finite number in single precision, or None for no bid")
    return sent


def newer(epoch: int, than: int) -> bool:
    """Return whether `epoch` is newer, modulo `EPOCHS`; they differ by less than half of it."""
    return 0 < (epoch - than) % EPOCHS < EPOCHS // 2


def stamp_us(local_ns: int) -> int:
    return local_ns // 1000 % STAMPS


def newer_stamp(stamp_us: int, than_us: int) -> bool:
    """Return whether a stamp is newer, modulo `STAMPS`; they differ by less than half of it, 35 minutes."""
    return 0 < (stamp_us - than_us) % STAMPS < STAMPS // 2


def head(sender: int) -> bytes:
    return _HEAD.pack(MAGIC, sender)


def pack(message: Message) -> bytes:
    match message:
        case Detection(target, number, seen_ns, x_m, y_m):
            return _DETECTION.pack(b"D", target, number, seen_ns, x_m, y_m)
        case Bid(task, epoch, left_us, reward):
            return _BID.pack(b"B", *task, epoch, min(max(left_us, 0), _MOST_US), reward)
        case Award(task, epoch, winner, reward):
            return _AWARD.pack(b"A", *task, epoch, winner, reward)
        case ModeMessage(mode, standing, task, epoch, reward, x_m, y_m):
            return _MODE.pack(b"M", mode, standing, *task, epoch, reward, x_m, y_m)
        case GreatestBid(task, epoch, bidder, left_us, reward):
            return _GREATEST.pack(b"G", *task, epoch, bidder, min(max(left_us, 0), _MOST_US), reward)
        case Flooded(origin, stamp, flooded):
            return _FLOODED.pack(b"R", origin, stamp) + pack(flooded)


def unpack(data: bytes, sensors: int) -> tuple[int, list[Message]] | None:
    """Return the sender and the messages of a frame of a team of `sensors`; None if any part of it is wrong."""
    if len(data) < _HEAD.size:
        return None
    magic, sender = _HEAD.unpack_from(data)
    if magic != MAGIC or sender >= sensors:
        return None
    messages: list[Message] = []
    at = _HEAD.size
    flooded: tuple[int, int] | None = None          # origin and stamp of the next message
    while at < len(data):
        form = _FORMS.get(data[at:at + 1])
        if form is None or at + form.size > len(data):
            return None
        fields = form.unpack_from(data, at)
        at += form.size
        if form is _FLOODED:
            if flooded is not None or fields[1] >= sensors:
                return None
            flooded = fields[1], fields[2]
            continue
        message = _message(fields, sensors)
        if message is None:
            return None
        if flooded is not None:
            if not isinstance(message, Detection | Award | ModeMessage):
                return None
            message, flooded = Flooded(*flooded, message), None
        messages.append(message)
    return None if flooded is not None else (sender, messages)


def _message(fields: tuple[object, ...], sensors: int) -> Message | None:
    match fields:
        case (b"D", int(target), int(number), int(seen_ns), float(x_m), float(y_m)) if isfinite(x_m) and isfinite(y_m):
            return Detection(target, number, seen_ns, x_m, y_m)
        case (b"B", int(target), int(stage), int(epoch), int(left_us), float(reward)) if (
                isfinite(reward) or reward == NO_BID):
            return Bid(Task(target, stage), epoch, left_us, reward)
        case (b"A", int(target), int(stage), int(epoch), int(winner), float(reward)) if (
                winner < sensors and isfinite(reward)):
            return Award(Task(target, stage), epoch, winner, reward)
        case (b"M", int(mode), int(standing), int(target), int(stage), int(epoch), float(reward), float(x_m),
              float(y_m)) if standing < len(Standing) and isfinite(reward) and isfinite(x_m) and isfinite(y_m):
            return ModeMessage(mode, Standing(standing), Task(target, stage), epoch, reward, x_m, y_m)
        case (b"G", int(target), int(stage), int(epoch), int(bidder), int(left_us), float(reward)) if (
                bidder < sensors and (isfinite(reward) or reward == NO_BID)):
            return GreatestBid(Task(target, stage), epoch, bidder, left_us, reward)
    return None


_FORMS: Final = {b"D": _DETECTION, b"B": _BID, b"A": _AWARD, b"M": _MODE, b"G": _GREATEST, b"R": _FLOODED}
