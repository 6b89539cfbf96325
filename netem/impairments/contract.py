"""Checks whether a class of a user can be an impairment, and answers for one that does not inherit `Impairment`."""

from __future__ import annotations

from typing import Any

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


def written_out(impairment: Any) -> bool:
    """Return whether a search writes out what the impairment does, copy by copy, as `Impairment.written_out` says."""
    own = getattr(impairment, "written_out", None)
    return bool(own()) if own is not None else hasattr(impairment, "rng")


def only_loses(cls: type) -> bool:
    """Return whether a copy that an impairment of this class does not lose leaves as it entered; False if unknown."""
    return bool(getattr(cls, "only_loses", False))
