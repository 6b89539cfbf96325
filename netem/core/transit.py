"""A frame copy on its way over a directed link."""

from __future__ import annotations

import msgspec

from netem.core.frame import Frame


class Transit(msgspec.Struct, gc=False):
    """One copy of a frame on one directed link. An impairment yields a changed copy with `msgspec.structs.replace`.

    `number` counts the copies that entered this link, from 0; duplicates keep the number of their original.
    `sent_ns` is the instant at which the copy entered the link, `arrival_ns` (>= sent_ns) that at which it leaves.
    """

    number: int
    sent_ns: int
    arrival_ns: int
    data: bytes
    corrupt: bool = False
    copy: int = 0               # 0 the original, 1.. duplicates
    undetected: bool = False    # corrupt, and no checksum finds it
    frame: Frame | None = None  # of which it is a copy, the same object on all links; None in tests of one link
