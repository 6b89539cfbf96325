"""A CAN bus simulated bit by bit: every node is a state machine that drives a level and samples the wired AND.

The oracle for error frames and error counters. Written from ISO 11898-1, classical CAN, and knows nothing of what the
emulator's bus decides at the start of a frame. One bit of the bus can be inverted for all nodes at once, at a given
bit of a given transmission.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from netem.media.can.frame import CanFrame
from tests.netem.media.can.bit_by_bit import Bit, crc, encode


class SecondError(Exception):
    """A dominant bit within an error delimiter: an error within an error frame, which the emulator does not model."""


@dataclass
class Station:
    name: str
    waiting: list[tuple[int, CanFrame]]                 # (offered before this bit, frame), sent in this order
    tec: int = 0
    rec: int = 0
    taken: list[tuple[int, CanFrame]] = field(default_factory=list)     # (bit after which it was valid, frame)
    sent: list[tuple[int, CanFrame]] = field(default_factory=list)
    mode: str = "idle"
    count: int = 0                                      # bits in this mode
    sending: list[Bit] | None = None
    frame: CanFrame | None = None
    bits: list[int] = field(default_factory=list)       # of the frame, with stuff bits
    plain: list[int] = field(default_factory=list)
    run: int = 0
    stage: str = ""
    driven: int = 1
    suspended: bool = False
    was_transmitter: bool = False
    exempt: bool = False                                # an error that leaves TEC alone, unless ...
    alone_passive: bool = False                         # ... passive, no acknowledgement, and no dominant bit since
    flag: list[int] = field(default_factory=list)
    overload: bool = False

    @property
    def passive(self) -> bool:
        return self.tec > 127 or self.rec > 127

    @property
    def off(self) -> bool:
        return self.tec > 255

    def may_start(self, now: int) -> bool:
        return bool(self.waiting) and self.waiting[0][0] <= now

    def drive(self, now: int) -> int:
        self.driven = 1
        if self.off:
            return 1
        if self.mode == "idle" and not self.suspended and self.may_start(now):
            self.frame = self.waiting[0][1]
            self.sending = encode(self.frame, acknowledged=False)
            self.begin()
        if self.mode == "frame":
            if self.sending is not None:
                self.driven = self.sending[len(self.bits)].level
            elif self.stage == "ACK slot" and self.crc_right():
                self.driven = 0
        elif self.mode == "flag" and (self.overload or not self.flagging_passively):
            self.driven = 0
        return self.driven

    def begin(self) -> None:
        self.mode, self.bits, self.plain, self.run, self.stage = "frame", [], [], 0, "stuffed"
        self.was_transmitter = self.sending is not None

    # --- what it makes of the bus

    def sample(self, level: int, now: int) -> None:
        if self.off:
            return
        getattr(self, f"in_{self.mode}")(level, now)

    def in_idle(self, level: int, now: int) -> None:
        if level == 0:
            self.begin()
            self.in_frame(level, now)
        elif self.suspended:
            self.count += 1
            self.suspended = self.count < 8

    def in_intermission(self, level: int, now: int) -> None:
        assert level == 1
        self.count += 1
        if self.count == 3:
            self.suspended = self.passive and self.was_transmitter
            self.mode, self.count = "idle", 0

    def in_frame(self, level: int, now: int) -> None:
        place = len(self.bits)
        self.bits.append(level)
        mine = self.sending[place].level if self.sending is not None else None
        if self.stage == "stuffed":
            self.in_stuffed(level, mine, now)
        elif self.stage == "CRC delimiter":
            self.stage = "ACK slot"
            if level == 0:
                self.error(now)
        elif self.stage == "ACK slot":
            self.stage = "ACK delimiter"
            if self.sending is not None:
                if level == 1:
                    self.alone_passive = self.passive
                    self.error(now)
            elif level != self.driven:
                self.error(now)
            elif self.driven == 0:
                self.rec = min(self.rec - 1, 119) if self.rec > 127 else max(self.rec - 1, 0)
        elif self.stage == "ACK delimiter":
            self.stage, self.count = "EOF", 0
            if level == 0 or (self.sending is None and not self.crc_right()):
                self.error(now)
        else:
            self.in_eof(level, now)

    def in_stuffed(self, level: int, mine: int | None, now: int) -> None:
        expected_stuff = self.run == 5
        if expected_stuff and level == self.bits[-2]:
            in_arbitration = mine is not None and self.in_arbitration()
            self.exempt = in_arbitration and mine == 1 and level == 0
            self.error(now)
            return
        if mine is not None and level != mine:
            if mine == 1 and self.in_arbitration() and not expected_stuff:
                self.sending = None                     # lost
                self.was_transmitter = False
            else:
                self.error(now)
                return
        self.run = self.run + 1 if len(self.bits) > 1 and level == self.bits[-2] else 1
        if not expected_stuff:
            self.plain.append(level)
        if self.complete() and self.run < 5:
            self.stage = "CRC delimiter"

    def in_eof(self, level: int, now: int) -> None:
        self.count += 1
        if level == 0:
            if self.count == 7 and self.sending is None:
                self.overload = True
            self.error(now)
            return
        if self.count == 6 and self.sending is None:
            self.taken.append((now + 1, self.read()))
        if self.count == 7:
            if self.sending is not None:
                assert self.frame is not None
                self.sent.append((now + 1, self.frame))
                self.waiting.pop(0)
                self.tec = max(self.tec - 1, 0)
            self.mode, self.count, self.sending = "intermission", 0, None

    def error(self, now: int) -> None:
        transmitter = self.sending is not None
        was_passive = self.passive
        if self.overload:
            pass
        elif transmitter:
            if not self.exempt and not self.alone_passive:
                self.tec += 8
        else:
            self.rec += 1
        self.flagging_passively = was_passive
        self.mode, self.count, self.flag, self.sending, self.exempt = "flag", 0, [], None, False

    def in_flag(self, level: int, now: int) -> None:
        self.flag.append(level)
        if level == 0 and self.alone_passive:
            self.tec += 8
            self.alone_passive = False
        if len(self.flag) >= 6 and (not self.flagging_passively or self.overload or len(set(self.flag[-6:])) == 1):
            self.mode, self.count = "delimiter", 0
            self.overload = self.alone_passive = False

    def in_delimiter(self, level: int, now: int) -> None:
        if level == 0:
            if self.count:
                raise SecondError(now)
            return
        self.count += 1
        if self.count == 8:
            self.mode, self.count = "intermission", 0

    flagging_passively: bool = False

    # --- reading

    def extended(self) -> bool:
        return len(self.plain) > 13 and self.plain[13] == 1

    def in_arbitration(self) -> bool:
        """The bit just sampled belongs to SOF .. RTR."""
        place = len(self.plain)                                 # of the bit, or of the one after a stuff bit
        if self.run == 5:
            place -= 1
        return place <= (32 if self.sends_extended() else 12)

    def sends_extended(self) -> bool:
        return self.frame is not None and self.frame.extended

    def dlc_end(self) -> int:
        return 39 if self.extended() else 19

    def data_bits(self) -> int:
        remote = self.plain[32] if self.extended() else self.plain[12]
        dlc = int("".join(map(str, self.plain[self.dlc_end() - 4:self.dlc_end()])), 2)
        return 0 if remote else 8 * min(dlc, 8)

    def complete(self) -> bool:
        end = self.dlc_end()
        return len(self.plain) >= end and len(self.plain) == end + self.data_bits() + 15

    def crc_right(self) -> bool:
        return crc(self.plain[:-15], 15, 0x4599, 0) == self.plain[-15:]

    def read(self) -> CanFrame:
        def value(levels: Sequence[int]) -> int:
            return int("".join(map(str, levels)), 2)
        end, extended = self.dlc_end(), self.extended()
        can_id = value(self.plain[1:12] + self.plain[14:32]) if extended else value(self.plain[1:12])
        remote = bool(self.plain[32] if extended else self.plain[12])
        data = self.plain[end:end + self.data_bits()]
        return CanFrame(can_id, bytes(value(data[place:place + 8]) for place in range(0, len(data), 8)), extended,
                        remote, dlc=value(self.plain[end - 4:end]))


def simulate(stations: Sequence[Station], bits: int, hits: Mapping[int, int]) -> None:
    """`hits[transmission]` is the bit of that transmission, from SOF = 0, that all see inverted."""
    transmission, place = -1, -1
    for now in range(bits):
        idle = all(station.mode in ("idle", "intermission") or station.off for station in stations)
        level = min(station.drive(now) for station in stations)
        if idle and level == 0:
            transmission, place = transmission + 1, 0
        if place == hits.get(transmission):
            level = 1 - level
        place += 1
        for station in stations:
            station.sample(level, now)
