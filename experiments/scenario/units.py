"""Time in a scenario file: a field `x_ns` is written `x_s`, `x_ms`, `x_us` or `x_ns` and becomes an int of nanoseconds.

The conversion is decimal: 0.0011 s is exactly 1100000 ns. A fraction of a nanosecond is rounded to the nearest one.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from math import isfinite
from typing import Any, Final

from netem.wire.instants import NEVER_NS

NS_PER: Final = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}
_UNIT_NAME: Final = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}


def spellings(field: str) -> dict[str, str]:
    """Key as written -> its unit, for a field of a table; {} if it is no time."""
    stem = field.removesuffix("_ns")
    return {f"{stem}_{unit}": unit for unit in NS_PER} if field.endswith("_ns") and stem else {}


def siblings(key: str) -> list[str]:
    """The other spellings of the time that is written as `key`; [] if its name has no unit of time."""
    stem, _, unit = key.rpartition("_")
    return [f"{stem}_{other}" for other in NS_PER if other != unit] if stem and unit in NS_PER else []


def to_ns(value: Any, unit: str, complain: Callable[[tuple[str | int, ...], str, Any], None]) -> Any:
    """`value`, a number or lists and tables of them, in nanoseconds; `complain(path within value, rule, part)`."""
    if isinstance(value, list):
        return [to_ns(part, unit, _within(complain, index)) for index, part in enumerate(value)]
    if isinstance(value, dict):
        return {key: to_ns(part, unit, _within(complain, key)) for key, part in value.items()}
    if isinstance(value, bool) or not isinstance(value, int | float):
        complain((), f"expected a number of {_UNIT_NAME[unit]}", value)
        return 0
    if not isfinite(value):
        complain((), "expected a finite number", value)
        return 0
    exact = Decimal(repr(value)) * NS_PER[unit]
    if abs(exact) >= NEVER_NS:
        complain((), f"expected less than {NEVER_NS // NS_PER[unit]} {_UNIT_NAME[unit]}, the end of time", value)
        return 0
    rounded = round(exact)
    if rounded == 0 and exact != 0:
        complain((), "less than half a nanosecond, the resolution of simulated time; write 0 or at least 1 ns", value)
    return rounded


def _within(complain: Callable[[tuple[str | int, ...], str, Any], None],
            part: str | int) -> Callable[[tuple[str | int, ...], str, Any], None]:
    return lambda path, rule, value: complain((part, *path), rule, value)
