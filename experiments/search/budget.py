"""Reads `--budget`: how many frames of a link a search may lose, as weakly-hard limits, and how many faults may occur.

    radio: * -> *: at most 2 lost in a row      of 3 frames in succession on a link at most 2 are lost
    radio: a -> b: at most 3 lost of 10         of 10 frames in succession at most 3 are lost
    faults: at most 3                           of any kind that something in the scenario can take (Fault.candidates)
    faults: at most 3 of kill, pause

A limit "at most m of k" is what Bernat, Burns and Llamosi (2001, "Weakly hard real-time systems", definitions 3 and 4)
write as a bound on misses in any window of k. Several limits on one link hold together. A link counts the frames that
enter it, which is after the medium: frames that collide are not among them.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from experiments.scenario.problems import near
from netem.core import link_selector
from netem.core.link_name import LinkName
from netem.faults.table import FAULTS

FORM: Final = re.compile(r"(?P<on>.+?)\s*:\s*at\s+most\s+(?P<most>\d{1,9})\s+lost\s+"
                         r"(?:in\s+a\s+row|of\s+(?P<of>\d{1,9}))")
FAULTS_FORM: Final = re.compile(r"faults\s*:\s*at\s+most\s+(?P<most>\d{1,6})(?:\s+of\s+(?P<kinds>[\w\s,]+))?")
RULE: Final = ('expected "MEDIUM: SENDER -> RECEIVER: at most 2 lost in a row", "...: at most 3 lost of 10", or '
               '"faults: at most 3 of kill, pause"')
MOST_FRAMES: Final = 100_000        # in the window of a limit


class BadBudget(ValueError):
    """A budget cannot be read, or nothing can use it."""

    exit_code = 2


@dataclass(frozen=True)
class LossLimit:
    """A link loses at most `most` of any `of` frames in succession."""

    most: int
    of: int


@dataclass(frozen=True)
class Budget:
    """`losses` are the limits of each link on which frames may be lost; `kinds` those of `faults`, the most faults."""

    losses: Mapping[LinkName, tuple[LossLimit, ...]] = field(default_factory=dict)
    faults: int = 0
    kinds: tuple[str, ...] = ()


def read_budget(texts: Sequence[str], nodes_on: Mapping[str, Collection[str]],
                to_themselves: Mapping[str, Collection[str]]) -> Budget:
    """Return what the texts of `--budget` allow on the links of these media; BadBudget, with the rule."""
    losses: dict[LinkName, tuple[LossLimit, ...]] = {}
    faults: int | None = None
    kinds: tuple[str, ...] = ()
    for text in texts:
        if (found := FAULTS_FORM.fullmatch(text.strip())) is not None:
            if faults is not None:
                raise BadBudget(f"--budget {text!r}: the number of faults is limited already; give one such budget")
            faults, kinds = int(found["most"]), _kinds(text, found["kinds"])
            if not faults:
                raise BadBudget(f"--budget {text!r}: allows no fault, so nothing can use it: expected at least 1")
        elif (found := FORM.fullmatch(text.strip())) is not None:
            limit = _limit(text, int(found["most"]), found["of"])
            try:
                links = link_selector.parse(found["on"]).resolve(nodes_on, to_themselves)
            except ValueError as error:
                raise BadBudget(f"--budget {text!r}: {error}") from None
            losses |= {link: (*losses.get(link, ()), limit) for link in links}
        else:
            raise BadBudget(f"--budget {text!r}: {RULE}")
    return Budget(losses, faults or 0, kinds)


def _limit(text: str, most: int, of: str | None) -> LossLimit:
    window = most + 1 if of is None else int(of)
    if not most:
        raise BadBudget(f"--budget {text!r}: allows no loss, so nothing can use it: expected at least 1")
    if not most < window <= MOST_FRAMES:
        raise BadBudget(f"--budget {text!r}: expected at most M lost of K with M < K <= {MOST_FRAMES}")
    return LossLimit(most, window)


def _kinds(text: str, named: str | None) -> tuple[str, ...]:
    kinds = tuple(kind.strip() for kind in (named or "").split(",") if kind.strip())
    for kind in kinds:
        if kind not in FAULTS:
            raise BadBudget(f"--budget {text!r}: there is no fault {kind!r}; {near(kind, FAULTS)}")
    return kinds


def breach(lost: Sequence[int], limits: Sequence[LossLimit]) -> str:
    """Return in words which window of frames breaks a limit, "" if none does.

    A count over each window that begins with a lost frame: it shares no code with what makes the patterns.
    """
    twice = [number for number, times in Counter(lost).items() if times > 1]
    if twice or any(number < 0 for number in lost):
        return f"frame {min(twice or lost)} is lost twice, or there is no such frame"
    for limit in limits:
        for first in lost:
            found = sum(first <= number < first + limit.of for number in lost)
            if found > limit.most:
                return (f"{found} of the frames {first} to {first + limit.of - 1} are lost: expected at most "
                        f"{limit.most}")
    return ""
