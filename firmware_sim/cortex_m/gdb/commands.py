"""Answers gdb's packets about a machine that stands still, until one lets it go on.

    g G p P m M X Z0 Z1 z0 z1 qSupported qXfer qRcmd ...    answered here
    c s vCont bs bc D k                                     returned as a `Resume`

A packet that cannot be read or carried out is answered with an error; one that is not known with an empty packet, as
the protocol wants it.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Final, NamedTuple, Protocol

from firmware_sim.cortex_m.gdb.target_description import BYTES, NAMES, PLACES, TARGET_XML

MOST_BYTES: Final = 2048            # of memory in one answer
PACKET_BYTES: Final = 2 * MOST_BYTES + 64
BAD: Final = b"E01"                 # the packet
CANNOT: Final = b"E0e"              # EFAULT: no memory, or not to be written
SUPPORTED: Final = (b"PacketSize=%x;qXfer:features:read+;QStartNoAckMode+;swbreak+;hwbreak+;vContSupported+;"
                    b"ReverseStep+;ReverseContinue+" % PACKET_BYTES)
FIXED: Final = {b"qfThreadInfo": b"m1", b"qsThreadInfo": b"l", b"qC": b"QC1", b"qAttached": b"1", b"T1": b"OK",
                b"vCont?": b"vCont;c;C;s;S;r", b"QStartNoAckMode": b"OK"}


class Go(Enum):
    ON = "continue"
    STEP = "step one instruction"
    STEP_WITHIN = "step until the program counter leaves a range"
    BACK_STEP = "go back one instruction"
    BACK_ON = "go back to the last breakpoint"
    ALONE = "go on without a debugger"
    END = "end the run"


class Resume(NamedTuple):
    go: Go
    first: int = 0                  # of a range, its end beyond it
    end: int = 0


class Machine(Protocol):
    """The machine that gdb's packets read and write; a write that it refuses returns False."""

    def registers(self) -> bytes: ...
    def write_register(self, number: int, value: bytes) -> bool: ...
    def read_memory(self, address: int, length: int) -> bytes: ...
    def write_memory(self, address: int, data: bytes) -> bool: ...
    def set_breakpoint(self, address: int) -> bool: ...
    def clear_breakpoint(self, address: int) -> None: ...


def answer(packet: bytes, machine: Machine, stopped: bytes, monitor: Callable[[str], str]) -> bytes | Resume:
    """Return the answer to a packet; `stopped` says why the machine stands still, `monitor` answers `monitor ...`."""
    try:
        return _answer(packet, machine, stopped, monitor)
    except (ValueError, IndexError):
        return BAD


def _answer(packet: bytes, machine: Machine, stopped: bytes, monitor: Callable[[str], str]) -> bytes | Resume:
    if packet in FIXED:
        return FIXED[packet]
    letter, rest = packet[:1], packet[1:]
    if letter == b"?":
        return stopped
    if letter in b"cCsSbDkv":
        return _resume(packet)
    if letter == b"H":
        return b"OK"
    if letter == b"g":
        return machine.registers().hex().encode()
    if letter == b"p":
        number = int(rest, 16)
        return machine.registers()[PLACES[number]:PLACES[number] + BYTES[number]].hex().encode()
    if letter == b"P":
        name, _, value = rest.partition(b"=")
        return _done(machine.write_register(int(name, 16), bytes.fromhex(value.decode())))
    if letter == b"G":
        return _write_all(machine, bytes.fromhex(rest.decode()))
    if letter in b"mMX":
        return _memory(letter, rest, machine)
    if letter in b"zZ" and rest[:2] in (b"0,", b"1,"):
        return _breakpoint(letter == b"Z", int(rest[2:].partition(b",")[0], 16), machine)
    if packet.startswith(b"qSupported"):
        return SUPPORTED
    if packet.startswith(b"qXfer:features:read:target.xml:"):
        offset, length = (int(number, 16) for number in packet.rpartition(b":")[2].split(b","))
        part = TARGET_XML[offset:offset + min(length, MOST_BYTES)]
        return (b"m" if offset + len(part) < len(TARGET_XML) else b"l") + part
    if packet.startswith(b"qRcmd,"):
        words = bytes.fromhex(packet[6:].decode()).decode(errors="replace")
        return monitor(words).encode().hex().encode()
    return b""


def _resume(packet: bytes) -> bytes | Resume:
    """Return how the machine goes on. Signals are ignored; an address to go on at, which gdb does not give, is bad."""
    if packet[:1] in b"cCsS" and packet[1:].rstrip(b"0123456789abcdefABCDEF") == b"":
        if packet[:1] in b"cs" and packet[1:]:
            return BAD
        return Resume(Go.STEP if packet[:1] in b"sS" else Go.ON)
    if packet.startswith(b"vCont;"):
        action = packet[6:].split(b";")[0].split(b":")[0]
        if action[:1] == b"r":
            first, end = (int(number, 16) for number in action[1:].split(b","))
            return Resume(Go.STEP_WITHIN, first, end)
        return Resume(Go.STEP if action[:1] in b"sS" else Go.ON) if action[:1] in b"cCsS" and action else BAD
    if packet == b"D" or packet.startswith(b"D;"):
        return Resume(Go.ALONE)
    if packet == b"k" or packet.startswith(b"vKill;"):
        return Resume(Go.END)
    return {b"bs": Resume(Go.BACK_STEP), b"bc": Resume(Go.BACK_ON)}.get(packet, b"")


def _memory(letter: bytes, rest: bytes, machine: Machine) -> bytes:
    place, _, data = rest.partition(b":")
    address, length = (int(number, 16) for number in place.split(b","))
    if not 0 <= address < 2**32 or length < 0:
        return BAD
    if letter == b"m":
        found = machine.read_memory(address, min(length, MOST_BYTES))
        return found.hex().encode() if found or not length else CANNOT
    content = data if letter == b"X" else bytes.fromhex(data.decode())
    return _done(not length or machine.write_memory(address, content)) if len(content) == length else BAD


def _breakpoint(sets: bool, address: int, machine: Machine) -> bytes:
    if not 0 <= address < 2**32:
        return BAD
    if sets:
        return _done(machine.set_breakpoint(address))
    machine.clear_breakpoint(address)
    return b"OK"


def _write_all(machine: Machine, data: bytes) -> bytes:
    """Write the registers that differ."""
    now = machine.registers()
    if len(data) != len(now):
        return BAD
    for number in range(len(NAMES)):
        place = slice(PLACES[number], PLACES[number] + BYTES[number])
        if data[place] != now[place] and not machine.write_register(number, data[place]):
            return CANNOT
    return b"OK"


def _done(done: bool) -> bytes:
    return b"OK" if done else CANNOT
