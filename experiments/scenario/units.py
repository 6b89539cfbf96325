"""Times in a scenario file: a field `x_ns` is written `x_s`, `x_ms`, `x_us` or `x_ns` and becomes int nanoseconds.

The conversion is decimal: 0.0011 s is exactly 1100000 ns. A fraction of a nanosecond is rounded to the nearest one.
"""

from __future__ import annotations

from decimal import Decimal
from math import isfinite
from typing import Any, Final

from netem.wire.instants import NEVER_NS, NS_PER

_UNIT_NAME: Final = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}


def spellings(field: str) -> dict[str, str]:
    """Return the keys by which a field may be written, each with its unit; {} if the field is no time."""
    stem = field.removesuffix("_ns")
    return {f"{stem}_{unit}": unit for unit in NS_PER} if field.endswith("_ns") and stem else {}


def siblings(key: str) -> list[str]:
    """Return the other spellings of the time that is written as `key`; [] if its name has no unit of time."""
    stem, _, unit = key.rpartition("_")
    return [f"{stem}_{other}" for other in NS_PER if other != unit] if stem and unit in NS_PER else []


def to_ns(value: Any, unit: str) -> int:
    """Return `value`, a number in `unit`, in nanoseconds; ValueError with the reason if it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"expected a number of {_UNIT_NAME[unit]}")
    if not isfinite(value):
        raise ValueError("expected a finite number")
    exact = Decimal(repr(value)) * NS_PER[unit]
    if abs(exact) >= NEVER_NS:
        raise ValueError(f"expected less than {NEVER_NS // NS_PER[unit]} {_UNIT_NAME[unit]}, the end of time")
    rounded = round(exact)
    if rounded == 0 and exact != 0:
        raise ValueError("less than half a nanosecond, the resolution of simulated time; write 0 or at least 1 ns")
    return rounded
