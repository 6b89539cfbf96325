"""Values of the library to those of messages (`netem/wire/zenoh_messages.py`), and back."""

from __future__ import annotations

from typing import Any

from firmware_sim.zenoh_programs.outside_subset import refuse
from firmware_sim.zenoh_programs.real import (
    MODULE,
    NTP64,
    CongestionControl,
    Encoding,
    KeyExpr,
    Priority,
    Timestamp,
    TimestampId,
    ZBytes,
)
from netem.wire.zenoh_messages import Qos, Stamp

# The library's enumerations are not hashable, so these are lists; the number of a priority is its place, from 1 on.
PRIORITIES = [Priority.REAL_TIME, Priority.INTERACTIVE_HIGH, Priority.INTERACTIVE_LOW, Priority.DATA_HIGH,
              Priority.DATA, Priority.DATA_LOW, Priority.BACKGROUND]
SHARED = tuple(getattr(MODULE.shm, name) for name in ("ZShm", "ZShmMut") if hasattr(MODULE.shm, name))


def key_of(value: Any) -> KeyExpr:
    """Return the key expression; ZError for none."""
    return value if isinstance(value, KeyExpr) else KeyExpr(value)


def payload_of(value: Any, name: str = "payload") -> bytes:
    """Return the bytes of a payload; TypeError for what the library takes for none."""
    if isinstance(value, ZBytes):
        return value.to_bytes()
    if isinstance(value, bytes | bytearray):
        return bytes(value)
    if isinstance(value, str):
        return value.encode()
    if isinstance(value, SHARED):
        refuse("shared memory")
    raise TypeError(f"argument '{name}': expected bytes/str type, found '{type(value).__name__}'")


def attachment_of(value: Any) -> bytes | None:
    return None if value is None else payload_of(value, "attachment")


def encoding_of(value: Any, otherwise: Encoding) -> Encoding:
    return otherwise if value is None else value if isinstance(value, Encoding) else Encoding(value)


def stamp_of(timestamp: Timestamp | None) -> Stamp | None:
    if timestamp is None:
        return None
    return Stamp(int(str(timestamp.get_time_as_ntp64())), bytes(timestamp.get_id()))


def timestamp_of(stamp: Stamp | None) -> Timestamp | None:
    """Return the library's timestamp; its fraction of a second is a whole number of nanoseconds, rounded up."""
    if stamp is None:
        return None
    nanoseconds = -(-(stamp.ntp64 & 0xFFFFFFFF) * 10**9 // 2**32)
    return Timestamp(NTP64(stamp.ntp64 >> 32, min(nanoseconds, 10**9 - 1)), TimestampId(stamp.clock))


def qos_of(priority: Priority | None, congestion: CongestionControl | None, express: bool | None,
           otherwise: Qos) -> Qos:
    """Return the values given, else those of `otherwise`; BLOCK_FIRST counts as BLOCK."""
    return Qos(otherwise.priority if priority is None else PRIORITIES.index(priority) + 1,
               otherwise.block if congestion is None else congestion != CongestionControl.DROP,
               otherwise.express if express is None else bool(express))
