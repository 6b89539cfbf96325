"""Describes how frames ended: "frames 13, 15 lost (impairments[0] scripted_loss), frame 14 collided"."""

from __future__ import annotations

from experiments.judge.monitors.link_frames import LinkFrames
from experiments.judge.monitors.outcome import seconds
from netem.wire.instants import NEVER_NS

MOST_NUMBERS = 4


def frames_in_words(frames: LinkFrames, first: int, end: int, at_ns: int = NEVER_NS) -> str:
    """Describe rows `first` to `end` (exclusive) as of `at_ns`, grouped by how they ended, in order of occurrence.

    A frame that reached the node after `at_ns` is described as on its way.
    """
    alike: dict[str, list[int]] = {}
    endings = zip(frames.fate[first:end].values(), frames.cause[first:end].values(), strict=True)
    for row, (fate, cause) in enumerate(endings, first):
        arrives_ns = int(frames.delivered_ns[row])
        if at_ns < arrives_ns < NEVER_NS:
            how = f"on its way until {seconds(arrives_ns)}"
        else:
            how = f"{fate} ({cause})" if cause else fate
        alike.setdefault(how, []).append(int(frames.number[row]))
    return ", ".join(f"{_numbers(numbers)} {how}" for how, numbers in alike.items())


def _numbers(numbers: list[int]) -> str:
    if len(numbers) == 1:
        return f"frame {numbers[0]}"
    more = f" and {len(numbers) - MOST_NUMBERS} more" if len(numbers) > MOST_NUMBERS else ""
    return f"frames {', '.join(map(str, numbers[:MOST_NUMBERS]))}{more}"
