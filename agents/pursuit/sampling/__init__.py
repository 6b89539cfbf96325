"""When to look: a member of this kind is told what was asked for and seen, and says when the next look is due.

    asked(look_ns)                          a look was asked for, its exposure is at look_ns
    detected(seen_ns, place, surprised)     the newest detection; `surprised`: the filter is farther from it than rho
    next_look_ns(now_ns, own)               the first instant after now at which to look

The answer holds as long as nothing is detected and the pursuer, now at `own`, does not recede from what it saw last;
a later question may give a later instant, never an earlier one. Instants are multiples of T_s. The first looks, which
the filter starts from, are at consecutive instants.
"""

from __future__ import annotations

from typing import Protocol

from agents.pursuit import Place

FIRST_LOOKS = 3                 # a circle needs as many


class Sampling(Protocol):
    def asked(self, look_ns: int) -> None: ...

    def detected(self, seen_ns: int, place: Place, surprised: bool) -> None: ...

    def next_look_ns(self, now_ns: int, own: Place) -> int: ...


def check_step(step_ns: int) -> None:
    if step_ns < 1:
        raise ValueError(f"step_ns={step_ns}: expected 1 or more")
