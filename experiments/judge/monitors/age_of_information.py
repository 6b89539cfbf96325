"""A bound on the age of information on a directed link.

At time t the age is t minus the instant at which the newest frame delivered by t was offered. It grows between
deliveries, so it reaches the bound between frames, when the newest one is exactly that old.
`experiments.judge.link_metrics` has the pieces of the sawtooth.

    violated:  from newest + bound, until a frame arrives that is younger than the bound

Source: Kaul, Yates, Gruteser 2012 (real-time status: how often should one update?).
At the start every receiver holds information of age 0; a link on which nothing ever arrives has age t.
Not modelled: frames of several kinds on one link; each renews the information.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from experiments.judge.groups import Ints, new_group
from experiments.judge.link_metrics import NS_PER_S, sawtooth
from experiments.judge.monitors.frames_in_words import frames_in_words
from experiments.judge.monitors.link_frames import LinkFrames, link_frames
from experiments.judge.monitors.outcome import Finding, Violation, seconds
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.stretches import joined
from experiments.scenario.subjects import Named, Subject


@dataclass(frozen=True)
class AgeOfInformation:
    ON: ClassVar = Named.LINKS
    UNIT: ClassVar = "s"

    below_ns: int                   # > 0; an age that reaches it is a violation

    def __post_init__(self) -> None:
        if self.below_ns <= 0:
            raise ValueError(f"below_ns={self.below_ns}: expected more than 0")

    def requires(self) -> str:
        return f"age of information below {seconds(self.below_ns)}"

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        link, from_ns, to_ns, newest_ns = sawtooth(subjects, records.ledger, records.length_ns)
        if not link.size:
            return Finding(judged=False)
        oldest_ns = int((to_ns - newest_ns).max())
        worst, margin = oldest_ns / NS_PER_S, (self.below_ns - oldest_ns) / NS_PER_S
        start_ns = np.maximum(from_ns, newest_ns + min(self.below_ns, records.length_ns))
        late = np.flatnonzero(start_ns < to_ns)
        if not late.size:
            return Finding((), worst, margin)
        begin = joined(link[late], start_ns[late], to_ns[late])
        oldest_s = np.maximum.reduceat((to_ns - newest_ns)[late], begin) / NS_PER_S
        first, until_ns = late[begin], to_ns[late[np.r_[begin[1:], late.size] - 1]]
        nothing_yet = new_group(link)[first]
        link, newest_ns, at_ns = link[first], newest_ns[first], start_ns[first]
        frames = link_frames(records.ledger, subjects)
        since, end = _offered(frames, link, newest_ns, at_ns)
        since = np.where(nothing_yet, np.searchsorted(frames.link, link), since)
        columns = (link, newest_ns, at_ns, until_ns, oldest_s, since, end, nothing_yet)
        violations = []
        for of, newest, at, until, oldest, k, m, none in zip(*(column.tolist() for column in columns), strict=True):
            medium, sender, receiver = subjects[of]
            news = "the start" if none else f"the frame handed out at {seconds(newest)}"
            told = frames_in_words(frames, k, m, at) or "none was handed out"
            violations.append(Violation(f"{medium}: {sender} -> {receiver}", receiver, at, until, oldest,
                                        f"no news since {news}: {told}"))
        return Finding(violations, worst, margin)


def _offered(frames: LinkFrames, link: Ints, after_ns: Ints, until_ns: Ints) -> tuple[Ints, Ints]:
    """Rows [first, end) of the frames that were offered on `link` within (after, until]."""
    first, end = np.empty_like(link), np.empty_like(link)
    starts, ends = (np.searchsorted(frames.link, link, side=side) for side in ("left", "right"))
    for k, (start, until) in enumerate(zip(starts.tolist(), ends.tolist(), strict=True)):
        offered_ns = frames.offered_ns[start:until]
        first[k], end[k] = start + np.searchsorted(offered_ns, [after_ns[k], until_ns[k]], side="right")
    return first, end
