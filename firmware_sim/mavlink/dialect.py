"""Adapter: messages of MAVLink's common.xml to payload bytes and back. Only this file and c_headers.py know pymavlink.

Fields are by name, in the order of the wire; one that is not given is 0 (or empty). Text fields are bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any


@dataclass(frozen=True, slots=True)
class Message:
    name: str
    fields: Mapping[str, Any]

    def __getitem__(self, field: str) -> Any:
        return self.fields[field]


@dataclass(frozen=True)
class Layout:
    """The layout of the payload of one message type."""

    id: int
    name: str
    checksum_seed: int                      # CRC_EXTRA
    wire: struct.Struct
    fields: tuple[tuple[str, int], ...]     # (name, number of elements of `wire`)
    defaults: tuple[Any, ...]
    field_names: frozenset[str]


def layout(message_id: int) -> Layout | None:
    """Return the layout of a message type; None if it is not of this dialect."""
    return _layouts().get(message_id)


def layout_of(name: str) -> Layout:
    return _by_name()[name]


def message(name: str, /, **fields: Any) -> Message:
    """Return a message to send; raises for an unknown message or field."""
    known = layout_of(name).field_names
    assert known.issuperset(fields), f"{name} has no field {sorted(set(fields) - known)}"
    return Message(name, fields)


def pack(message: Message) -> bytes:
    """Return the payload, without the zeros at its end, as MAVLink 2 requires."""
    found = layout_of(message.name)
    values: list[Any] = []
    for name, count in found.fields:
        place = len(values)
        value = message.fields.get(name)
        if value is None:
            values += found.defaults[place:place + count]
        elif count == 1:
            values.append(value)
        else:
            values += [*value, *found.defaults[place + len(value):place + count]]
    payload = found.wire.pack(*values)
    return payload.rstrip(b"\0") or payload[:1]


def unpack(found: Layout, payload: bytes) -> Message:
    """Return the message; a short payload is padded with zeros, a long one, of a newer dialect, is cut."""
    size = found.wire.size
    values = found.wire.unpack(payload[:size].ljust(size, b"\0"))
    fields: dict[str, Any] = {}
    place = 0
    for name, count in found.fields:
        value = values[place] if count == 1 else values[place:place + count]
        fields[name] = value.partition(b"\0")[0] if isinstance(value, bytes) else value
        place += count
    return Message(found.name, fields)


def load_library() -> None:
    """Import pymavlink now, so that the first message need not, in each process."""
    _by_name()


@cache
def _layouts() -> dict[int, Layout]:
    from pymavlink.dialects.v20 import common  # here: the check of a scenario needs no message

    layouts = {}
    for number, cls in common.mavlink_map.items():
        wire = cls.unpacker
        layouts[int(number)] = Layout(int(number), str(cls.msgname), int(cls.crc_extra), wire,
                                      tuple(zip(cls.ordered_fieldnames, cls.lengths, strict=True)),
                                      wire.unpack(bytes(wire.size)), frozenset(cls.ordered_fieldnames))
    return layouts


@cache
def _by_name() -> dict[str, Layout]:
    return {found.name: found for found in _layouts().values()}
