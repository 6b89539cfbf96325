"""Entries of `[[impairments]]` that a program makes: what a script does to frames of a link, each by its number.

    Lost       scripted_loss            Late       scripted_delay
    Flipped    scripted_corruption      Doubled    scripted_duplicate

`changes_of` tells which of them repeat what an impairment did to one copy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from netem.impairments.traced import Effect


@dataclass(frozen=True)
class Change:
    """What happens to one frame. Of the entries of one impairment on a link, those of the least `rank` come first."""

    kind: ClassVar[str]
    rank: ClassVar[int]

    @classmethod
    def entry(cls, on: str, frames: Mapping[int, Any], copy: int | None = None) -> dict[str, Any]:
        """Return the entry that does this to frames by their numbers; `copy` is as in the scripts."""
        return {"on": on, "kind": cls.kind} | cls.fields(dict(sorted(frames.items()))) | (
            {} if copy is None else {"copy": copy})

    @classmethod
    def fields(cls, frames: Mapping[int, Any]) -> dict[str, Any]:
        raise NotImplementedError

    def in_words(self) -> str:
        raise NotImplementedError


@dataclass(frozen=True)
class Flipped(Change):
    kind: ClassVar = "scripted_corruption"
    rank: ClassVar = 0
    bits: tuple[int, ...]
    undetected: bool = False

    @classmethod
    def fields(cls, frames: Mapping[int, Any]) -> dict[str, Any]:
        found: dict[str, Any] = {"corrupt_frames": list(frames), "bits": [list(one.bits) for one in frames.values()]}
        return found | ({"undetected": True} if next(iter(frames.values())).undetected else {})

    def in_words(self) -> str:
        bits = f"bit{'s' if len(self.bits) > 1 else ''} {', '.join(map(str, self.bits))}"
        return f"has {bits} flipped{', undetected' if self.undetected else ''}"


@dataclass(frozen=True)
class Late(Change):
    kind: ClassVar = "scripted_delay"
    rank: ClassVar = 1
    delay_ns: int

    @classmethod
    def fields(cls, frames: Mapping[int, Any]) -> dict[str, Any]:
        return {"delay_frames": list(frames), "delays_ms": [one.delay_ns / 1e6 for one in frames.values()]}

    def in_words(self) -> str:
        return f"is late by {self.delay_ns / 1e6:.9g} ms"


@dataclass(frozen=True)
class Lost(Change):
    kind: ClassVar = "scripted_loss"
    rank: ClassVar = 2

    @classmethod
    def fields(cls, frames: Mapping[int, Any]) -> dict[str, Any]:
        return {"lose_frames": list(frames)}

    def in_words(self) -> str:
        return "is lost"


@dataclass(frozen=True)
class Doubled(Change):
    kind: ClassVar = "scripted_duplicate"
    rank: ClassVar = 3
    extra_delay_ns: int

    @classmethod
    def fields(cls, frames: Mapping[int, Any]) -> dict[str, Any]:
        return {"duplicate_frames": list(frames),
                "extra_delays_ms": [one.extra_delay_ns / 1e6 for one in frames.values()]}

    def in_words(self) -> str:
        return f"arrives twice, {self.extra_delay_ns / 1e6:.9g} ms apart"


def changes_of(effect: Effect) -> list[Change]:
    """Return what repeats an effect. Not modelled: flips that only a duplicate has, a third copy, an early arrival."""
    if not effect.out:
        return [Lost()]
    first, *others = effect.out
    found: list[Change] = [Flipped(first.bits, first.undetected)] if first.bits else []
    found += [Late(first.delay_ns)] if first.delay_ns > 0 else []
    return found + [Doubled(max(0, out.delay_ns - first.delay_ns)) for out in others[:1]]


def losing(on: str, lost: Sequence[int], every: int | None = None) -> dict[str, Any]:
    """Return an entry that loses these frames of each link that `on` selects, again after `every` frames."""
    return Lost.entry(on, dict.fromkeys(lost)) | ({} if every is None else {"every": every})
