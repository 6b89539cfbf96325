"""Zenoh's network messages, as far as programs and gateways use them; `zenoh_codec.py` turns them into bytes.

A key is a key expression in full. Numbers of entities and requests are those of the sending node.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple

ENCODINGS: Final = (
    "zenoh/bytes", "zenoh/string", "zenoh/serialized", "application/octet-stream", "text/plain", "application/json",
    "text/json", "application/cdr", "application/cbor", "application/yaml", "text/yaml", "text/json5",
    "application/python-serialized-object", "application/protobuf", "application/java-serialized-object",
    "application/openmetrics-text", "image/png", "image/jpeg", "image/gif", "image/bmp", "image/webp",
    "application/xml", "application/x-www-form-urlencoded", "text/html", "text/xml", "text/css", "text/javascript",
    "text/markdown", "text/csv", "application/sql", "application/coap-payload", "application/json-patch+json",
    "application/json-seq", "application/jsonpath", "application/jwt", "application/mp4", "application/soap+xml",
    "application/yang", "audio/aac", "audio/flac", "audio/mp4", "audio/ogg", "audio/vorbis", "video/h261",
    "video/h263", "video/h264", "video/h265", "video/h266", "video/mp4", "video/ogg", "video/raw", "video/vp8",
    "video/vp9")


class MalformedZenohFrame(ValueError):
    """Bytes that are no frame of this format."""


class Entity(IntEnum):
    """What a session declares; the value is the number of its declaration."""

    SUBSCRIBER = 2
    QUERYABLE = 4
    TOKEN = 6


class Qos(NamedTuple):
    """Priority 1 (real time) to 7 (background); `block`: congestion control BLOCK, else DROP."""

    priority: int = 5
    block: bool = False
    express: bool = False


USUAL: Final = Qos()                        # of a put
OF_QUERIES: Final = Qos(block=True)         # of a query and its replies
DECLARED: Final = Qos(0, block=True)        # of declarations and interests: the priority of control messages


class Stamp(NamedTuple):
    """A timestamp: 32 bits of seconds and 32 of their fraction, and the identifier of the clock, 1 to 16 bytes."""

    ntp64: int
    clock: bytes


@dataclass(frozen=True, slots=True)
class Data:
    """What a put, a delete or a reply carries."""

    payload: bytes = b""
    encoding: str = ENCODINGS[0]
    attachment: bytes | None = None
    stamp: Stamp | None = None
    deletes: bool = False               # True: a delete, without payload and encoding


@dataclass(frozen=True, slots=True)
class Push:
    key: str
    data: Data
    qos: Qos = USUAL


@dataclass(frozen=True, slots=True)
class Request:
    """A query. `target`: 0 best matching, 1 all, 2 all complete; `consolidation`: 0 auto, 1 none, 2 monotonic, 3
    latest; `payload` is None or a value with `encoding`.
    """

    number: int
    key: str
    parameters: str = ""
    target: int = 0
    consolidation: int = 0
    timeout_ms: int = 10_000
    payload: bytes | None = None
    encoding: str = ENCODINGS[0]
    attachment: bytes | None = None
    qos: Qos = OF_QUERIES


@dataclass(frozen=True, slots=True)
class Response:
    """A reply to request `number` of the receiver, from entity `entity` of session `session`; `error`: a reply error,
    whose data has neither attachment nor stamp.
    """

    number: int
    key: str
    data: Data
    session: bytes
    entity: int
    error: bool = False
    qos: Qos = OF_QUERIES


@dataclass(frozen=True, slots=True)
class ResponseFinal:
    """The last message for request `number` of the receiver."""

    number: int
    qos: Qos = OF_QUERIES


@dataclass(frozen=True, slots=True)
class Declare:
    entity: Entity
    number: int
    key: str
    complete: bool = False              # of a queryable


@dataclass(frozen=True, slots=True)
class Undeclare:
    entity: Entity
    number: int


@dataclass(frozen=True, slots=True)
class Interest:
    """The request that every receiver declares again what it has declared."""

    number: int


Message = Push | Request | Response | ResponseFinal | Declare | Undeclare | Interest


def priority_of(message: Message) -> int:
    """Return the priority by which the transport sends a message, 0 for declarations."""
    return DECLARED.priority if isinstance(message, Declare | Undeclare | Interest) else message.qos.priority
