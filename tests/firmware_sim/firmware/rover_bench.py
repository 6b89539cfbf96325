"""A rover with the firmware `mavlink_rover` by itself, and a ground station of pymavlink at its serial port."""

from __future__ import annotations

from random import Random
from typing import Any

from pymavlink.dialects.v20 import common

from firmware_sim.firmware.build import FIRMWARE
from firmware_sim.firmware.description import read_description
from firmware_sim.firmware.program import firmware_class
from fmus.build import build_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from netem.wire.messages import Report
from tests.firmware_sim.board_bench import BoardBench

FOLDER = FIRMWARE / "mavlink_rover"
MS = 1_000_000
S = 1_000_000_000
HEARD = {"PARAM_REQUEST_LIST": 0, "PARAM_REQUEST_READ": 2, "PARAM_SET": 4, "COMMAND_LONG": 30, "COMMAND_INT": 30,
         "MANUAL_CONTROL": 10, "PING": 12, "TIMESYNC": None, "HEARTBEAT": None}       # place of target_system


def station(system: int = 255) -> Any:
    mav = common.MAVLink(None, srcSystem=system, srcComponent=190)
    mav.robust_parsing = True
    return mav


class Rover:
    """`say(message, ...)` lets messages arrive and returns the answers of the next millisecond."""

    def __init__(self, target: str = "host", quiet: bool = False, **parameters: Any) -> None:
        self.bench = BoardBench(ports=("serial",))
        self.plant = Plant(describe(build_model("unicycle")), "robot", {}, present=self.bench.node.present_ns)
        made = _class(target)
        made(self.bench.board(self.plant), made.Settings(**parameters))     # type: ignore[attr-defined]
        self.mav, self.now_ns = station(), 0
        self.counters: dict[str, int] = {}
        self.events: list[str] = []
        self.sent: list[tuple[int, bytes]] = []
        if quiet:
            for message in (0, 2, 30, 32):
                self.command(511, message, -1)

    def hear(self, data: bytes, duration_ns: int = MS) -> list[Any]:
        """Let bytes arrive; return the messages that the rover sends until `duration_ns` later."""
        arrivals = [(self.now_ns, 0, data)] if data else []
        self.now_ns += duration_ns
        report: Report = self.bench.until(self.now_ns, *arrivals)
        self.counters |= report.counters
        self.events += [event[1] for event in report.events]
        self.sent += [(time_ns, frame) for time_ns, _, frame in report.offers]
        return [message for _, _, frame in report.offers for message in self.mav.parse_buffer(frame) or []]

    def run(self, duration_ns: int) -> list[Any]:
        return self.hear(b"", duration_ns)

    def say(self, *messages: Any) -> list[Any]:
        data = b""
        for message in messages:
            data += message.pack(self.mav)
            self.mav.seq = (self.mav.seq + 1) % 256
        return self.hear(data)

    def command(self, number: int, *parameters: float) -> int:
        """Return the result by which the rover answers a COMMAND_LONG."""
        padded = (*parameters, *(0.0,) * (7 - len(parameters)))
        (ack,) = [answer for answer in self.say(self.mav.command_long_encode(1, 1, number, 0, *padded))
                  if answer.get_type() == "COMMAND_ACK"]
        assert (ack.command, ack.target_system, ack.target_component) == (number, 255, 190)
        return int(ack.result)


def _class(target: str) -> type:
    if target == "host":
        return firmware_class(read_description(FOLDER), FOLDER)
    from firmware_sim.cortex_m.firmware import CortexFirmwareProgram, build_for_cortex_m4

    return firmware_class(read_description(FOLDER), FOLDER, None, CortexFirmwareProgram, build_for_cortex_m4)


def inputs(count: int, seed: int = 1) -> list[bytes]:
    """Return damaged frames, frames with any fields under a right checksum, and noise."""
    rng, mav = Random(seed), station()
    kinds = list(common.mavlink_map.values())
    heard = [kind for kind in kinds if kind.msgname in HEARD]
    made = []
    for _ in range(count):
        kind = rng.choice(heard if rng.random() < 0.8 else kinds)
        data = bytearray(_frame(mav, kind, rng))
        damage = rng.randrange(6)
        place = rng.randrange(len(data))
        if damage == 0:
            data[place] ^= 1 << rng.randrange(8)
        elif damage == 1:
            del data[place:]
        elif damage == 2:
            data[place:place] = rng.randbytes(rng.randrange(1, 5))
        elif damage == 3:
            data = bytearray(rng.randbytes(rng.randrange(300)))
        made.append(bytes(data))                # 4, 5: as it is
    return made


def _frame(mav: Any, kind: Any, rng: Random) -> bytes:
    """Return a frame of this kind with any bytes as its payload, of any length, some signed, some of MAVLink 1."""
    payload = bytearray(rng.randbytes(rng.choice([kind.unpacker.size, rng.randrange(256)])))
    for place in range(0, len(payload) - 3, 4):
        if rng.random() < 0.3:                  # NaN, infinities, extremes, the names of things
            payload[place:place + 4] = rng.choice([b"\0\0\xc0\x7f", b"\0\0\x80\x7f", b"\0\0\x80\xff", b"\xff" * 4,
                                                   b"\0" * 4, b"\0\0\x80\x3f", b"SPEE", b"\x01\x01\x90\x01"])
    to = HEARD.get(kind.msgname)
    if to is not None and rng.random() < 0.8:
        payload[to:to + 1 + (kind.msgname != "MANUAL_CONTROL")] = b"\x01\x01"[:1 + (kind.msgname != "MANUAL_CONTROL")]
    signed = rng.random() < 0.1
    head = bytes([len(payload), int(signed), 0, rng.randrange(256), 255, 190]) + kind.id.to_bytes(3, "little")
    if kind.id < 256 and rng.random() < 0.1:
        signed, head = False, bytes([len(payload), rng.randrange(256), 255, 190, kind.id])
    body = head + payload
    crc = common.x25crc(body)
    crc.accumulate(bytes([kind.crc_extra]))
    mark = b"\xfd" if len(head) == 9 else b"\xfe"
    return mark + body + crc.crc.to_bytes(2, "little") + (rng.randbytes(13) if signed else b"")
