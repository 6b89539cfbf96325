"""At most m successive losses on a directed link: the weakly hard constraint (m + 1 misses in a row never happen).

Frames count in the order of their offers; a frame is lost if no copy of it was delivered intact. It counts as lost from
the end of its transmission, or from its offer if it was never on the air.

    violated:  from the instant at which the first m + 1 frames of a row are lost, until the next delivery

Source: Bernat, Burns, Llamosi 2001 (weakly hard real-time systems), the constraint of at most m consecutive misses.
Frames that are unfinished at the end do not count.
Not modelled: frames of several kinds on one link, which count alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from experiments.judge.groups import new_group
from experiments.judge.monitors.frames_in_words import frames_in_words
from experiments.judge.monitors.link_frames import link_frames
from experiments.judge.monitors.outcome import Finding, Violation
from experiments.judge.monitors.records import Records
from experiments.scenario.subjects import Named, Subject
from netem.wire.instants import NEVER_NS


@dataclass(frozen=True)
class SuccessiveLosses:
    ON: ClassVar = Named.LINKS
    UNIT: ClassVar = ""

    at_most: int                    # m >= 0, frames

    def __post_init__(self) -> None:
        if self.at_most < 0:
            raise ValueError(f"at_most={self.at_most}: expected 0 or more frames in a row")

    def requires(self) -> str:
        return f"at most {self.at_most} successive losses"

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        frames = link_frames(records.ledger, subjects)
        counted = np.flatnonzero(~frames.unfinished)
        link, lost = frames.link[counted], frames.delivered_ns[counted] == NEVER_NS
        starts = np.flatnonzero(new_group(link, lost.astype(np.int64)))
        lengths = np.diff(np.r_[starts, counted.size])
        rows = lost[starts]
        longest = int(lengths[rows].max(initial=0))
        starts, lengths = starts[rows & (lengths > self.at_most)], lengths[rows & (lengths > self.at_most)]
        if not starts.size:
            return Finding((), float(longest), float(self.at_most - longest))
        enough = starts + self.at_most + 1                          # the row's first m + 1 frames end before here
        ended_ns = np.r_[frames.ended_ns[counted], 0]
        from_ns = np.maximum.reduceat(ended_ns, np.column_stack([starts, enough]).ravel())[::2]
        after = np.minimum(starts + lengths, counted.size - 1)      # the delivered frame after the row, if there is one
        heard = (starts + lengths < counted.size) & (link[after] == link[starts])
        until_ns = np.where(heard, frames.delivered_ns[counted][after], records.length_ns)
        until_ns = np.minimum(np.maximum(until_ns, from_ns), records.length_ns)
        violations = []
        for k in np.flatnonzero(from_ns < records.length_ns):
            medium, sender, receiver = subjects[int(link[starts[k]])]
            cause = frames_in_words(frames, int(counted[starts[k]]), int(counted[enough[k] - 1]) + 1)
            violations.append(Violation(f"{medium}: {sender} -> {receiver}", receiver, int(from_ns[k]),
                                        int(until_ns[k]), float(lengths[k]), cause))
        return Finding(violations, float(longest), float(self.at_most - longest))
