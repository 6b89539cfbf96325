"""The library's own classes and functions, as they are before any is replaced; the room's only import of Zenoh.

Kept as they are are the classes of values: KeyExpr, ZBytes, Encoding, Selector, Parameters, Timestamp, Config and all
enumerations.
"""

from __future__ import annotations

from typing import Any, Final

import zenoh
import zenoh.ext
from zenoh import (
    NTP64,
    CongestionControl,
    ConsolidationMode,
    Encoding,
    KeyExpr,
    Locality,
    Parameters,
    Priority,
    QueryConsolidation,
    QueryTarget,
    Reliability,
    ReplyKeyExpr,
    SampleKind,
    Selector,
    Timestamp,
    TimestampId,
    ZBytes,
    ZError,
)

MODULE: Final[Any] = zenoh
HANDLERS: Final[Any] = zenoh.handlers
EXT: Final[Any] = zenoh.ext

__all__ = [
    "EXT",
    "HANDLERS",
    "MODULE",
    "NTP64",
    "CongestionControl",
    "ConsolidationMode",
    "Encoding",
    "KeyExpr",
    "Locality",
    "Parameters",
    "Priority",
    "QueryConsolidation",
    "QueryTarget",
    "Reliability",
    "ReplyKeyExpr",
    "SampleKind",
    "Selector",
    "Timestamp",
    "TimestampId",
    "ZBytes",
    "ZError",
]
