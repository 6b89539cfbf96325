"""The processor time of a run with all its processes."""

from __future__ import annotations

import resource


def processor_s() -> float:
    """Return the processor time of this process so far and of its children that have ended [s]."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)
