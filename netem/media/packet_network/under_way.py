"""A datagram under way: its fragments, and what each receiver has got of it."""

from __future__ import annotations

from typing import NamedTuple

from netem.core.frame import Frame
from netem.core.transit import Transit


class UnderWay:
    """The frame `frame` in `count` packets. A receiver is in `open` until its copy has a fate."""

    def __init__(self, frame: Frame, head: bytes, count: int, receivers: list[str]) -> None:
        self.frame = frame
        self.head = head                        # the header of the frame, which every fragment repeats
        self.count = count
        self.open = dict.fromkeys(receivers)
        self._got: dict[str, list[Transit]] = {}

    def reassemble(self, receiver: str, fragment: Transit) -> Transit | None:
        """Keep one more fragment, in order; return the whole frame if it was the last.

        The frame arrives with the last fragment to arrive, and is corrupt if one of them is.
        """
        got = self._got.setdefault(receiver, [])
        got.append(fragment)
        if len(got) < self.count:
            return None
        del self._got[receiver]
        flipped = [each for each in got if each.corrupt]
        return Transit(got[0].number, got[0].sent_ns, max([each.arrival_ns for each in got]),
                       self.head + b"".join([each.data for each in got]), bool(flipped),
                       undetected=bool(flipped) and all(each.undetected for each in flipped))


class Packet(NamedTuple):
    """A datagram that fits, or one fragment of it."""

    of: UnderWay
    payload: bytes
    size_bytes: int             # with header_bytes
    last: bool
