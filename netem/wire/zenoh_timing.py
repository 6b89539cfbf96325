"""When a node tells others on a medium what it has declared, so that a lost frame or a collision does not hide it.

Each instant is drawn from its interval, since nodes that begin at the same instant would collide otherwise. Programs in
virtual time and gateways in real time follow the same times, so that each takes the other's silence for what it is.
"""

from __future__ import annotations

from typing import Final

MS: Final = 1_000_000
TOLD_AFTER_NS: Final = ((0, 10 * MS), (50 * MS, 100 * MS), (200 * MS, 400 * MS))    # [from, to) of each telling
ANSWERED_WITHIN_NS: Final = 50 * MS     # to the request of a node that begins
SHAKEN: Final = 0.1                     # largest deviation of a repetition, as part of its period
