"""One end of a MAVLink link: reads messages for this end from bytes, and builds frames; a counter for each way to fail.

Bytes that are no frame of the dialect, and frames with a wrong or missing signature, of this end itself or addressed to
another system are counted and dropped.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from firmware_sim.mavlink.dialect import Message, layout_of, pack, unpack
from firmware_sim.mavlink.framing import Frame, FrameReader, build
from firmware_sim.mavlink.sequence_gaps import SequenceGaps
from firmware_sim.mavlink.signing import Signing, Verdict

INCOMPLETE_NS: Final = 100_000_000      # time without bytes after which an incomplete frame is given up


@dataclass(frozen=True, slots=True)
class Received:
    message: Message
    system: int
    component: int
    signed: bool
    port: int = 0               # of the link where it came in


@dataclass
class MavlinkLink:
    system: int
    component: int
    signing: Signing | None = None
    counts: Counter[str] = field(default_factory=Counter)
    gaps: SequenceGaps = field(default_factory=SequenceGaps)
    port: int = 0                       # number of this link among those of the same end
    on_frame: Callable[[Frame, Message], None] | None = None    # called for every frame taken, whoever it is for

    def __post_init__(self) -> None:
        self._reader = FrameReader(self.counts)
        self._sequence = 0
        self._heard_ns = 0

    def receive(self, data: bytes, now_ns: int) -> list[Received]:
        """Return the messages for this end that are complete with `data`."""
        frames = []
        if self._reader.incomplete and not 0 <= now_ns - self._heard_ns < INCOMPLETE_NS:
            frames = self._reader.give_up()
        if data:
            self._heard_ns = now_ns
            frames += self._reader.read(data)
        return [received for frame in frames if (received := self._admit(frame, now_ns)) is not None]

    def send(self, message: Message, now_ns: int) -> bytes:
        signing = self.signing if self.signing is not None and self.signing.sign_outgoing else None
        frame = build(layout_of(message.name), pack(message), self._sequence, self.system, self.component,
                      signed=signing is not None)
        self._sequence = (self._sequence + 1) % 256
        self.counts["frames sent"] += 1
        return frame if signing is None else frame + signing.sign(frame, now_ns)

    def _admit(self, frame: Frame, now_ns: int) -> Received | None:
        if (frame.system, frame.component) == (self.system, self.component):
            self.counts["own frames heard"] += 1
            return None
        verdict = Verdict.TAKEN if self.signing is None else self.signing.judge(frame, now_ns)
        if verdict is not Verdict.TAKEN:
            self.counts[f"frames refused: {verdict.value}"] += 1
            return None
        if missing := self.gaps.heard(frame.system, frame.component, frame.sequence):
            self.counts["frames lost"] += missing
            self.counts[f"frames lost from {frame.system}/{frame.component}"] += missing
        self.counts["frames taken"] += 1
        message = unpack(frame.layout, frame.payload)
        if self.on_frame is not None:
            self.on_frame(frame, message)
        if (message.fields.get("target_system", 0) not in (0, self.system)
                or message.fields.get("target_component", 0) not in (0, self.component)):
            self.counts["frames for others"] += 1
            return None
        return Received(message, frame.system, frame.component, bool(frame.signature), self.port)
