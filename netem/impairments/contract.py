"""Checks whether a class of a user can be an impairment."""

from __future__ import annotations

from netem.core.fate import Fate
from netem.impairments import Impairment


def complaint_about(cls: type) -> str:
    """Return one line that names what the class lacks and how to write it, "" if it lacks nothing."""
    carry = getattr(cls, "carry", None)
    if not callable(carry) or carry is Impairment.carry:
        return f"{cls.__name__} has no method carry(transit) that yields what comes out of the link"
    if not isinstance(getattr(cls, "loses_as", None), Fate):
        return (f"{cls.__name__} does not say how a copy ends that it drops; "
                "write `loses_as: ClassVar = Fate.LOST` in it")
    return ""
