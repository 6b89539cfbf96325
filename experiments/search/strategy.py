"""How a search goes on: extremal patterns first, then generations of mutants of the best and of random candidates.

    extremal     all links together, the links of one sender, those of one receiver, each link alone; single faults
    generation   (mu + lambda) (Beyer and Schwefel 2002): mutants and crosses of the MU best so far, some at random;
                 continuous settings come from CMA-ES

*Invariants*
- What is asked for depends on the seed and on the costs told, not on how many runs go on at a time: a generation has
  SIZE candidates, and the caller tells all of their costs before it asks for the next.
- A candidate is asked for once, unless DRAWS attempts bring no new one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Final, Protocol

from experiments.search.budget import Budget, breach
from experiments.search.continuous import Continuous
from experiments.search.fault_patterns import DrawnFault, FaultSpace
from experiments.search.loss_patterns import Pattern, crossed, extremal, mutated, randomly
from netem.core.link_name import LinkName
from netem.core.random_streams import stream

SIZE: Final = 20                # candidates of a generation
MU: Final = 8
RANDOM_SHARE: Final = 0.25
EXTREMAL_SHARE: Final = 0.5     # of all runs, at most
DRAWS: Final = 20


@dataclass(frozen=True)
class Candidate:
    """`losses` has the links that lose any frames; `settings` are shares of the varied ranges."""

    losses: tuple[tuple[LinkName, Pattern], ...] = ()
    faults: tuple[DrawnFault, ...] = ()
    settings: tuple[float, ...] = ()

    @property
    def size(self) -> int:
        """The number of losses and faults."""
        return sum(len(pattern) for _, pattern in self.losses) + len(self.faults)


@dataclass(frozen=True)
class Space:
    """What a search chooses from. `frames` has the number of frames of each link that the budget lets lose any."""

    budget: Budget
    frames: dict[LinkName, int]
    faults: FaultSpace
    dimensions: int = 0

    def check(self, candidate: Candidate) -> str:
        """Return how a candidate breaks the budget, "" if it does not."""
        if len(candidate.faults) > self.budget.faults:
            return f"{len(candidate.faults)} faults: expected at most {self.budget.faults}"
        for link, pattern in candidate.losses:
            if link not in self.budget.losses:
                return f"{link} may lose nothing"
            if found := breach(pattern, self.budget.losses[link]):
                return f"{link}: {found}"
        return ""


class Strategy(Protocol):
    def ask(self) -> list[Candidate]:
        """Return the next candidates, at least one."""

    def tell(self, costs: Sequence[tuple[float, Candidate]]) -> None:
        """Take the costs of all candidates that were asked for last, in their order; the least is the best."""


class RandomSearch:
    """Draws every candidate anew, within the budget: what a better search is compared with."""

    def __init__(self, space: Space, seed: int) -> None:
        self.space = space
        self.rng = stream(seed, "search")
        self._asked: set[str] = set()

    def ask(self) -> list[Candidate]:
        return [self.new(self.randomly) for _ in range(SIZE)]

    def tell(self, costs: Sequence[tuple[float, Candidate]]) -> None:
        """Learn nothing."""

    def new(self, draw: Callable[[], Candidate]) -> Candidate:
        """Return a candidate that was not asked for, if there is one in DRAWS."""
        for _ in range(DRAWS):
            candidate = draw()
            if self.is_new(candidate):
                break
        return candidate

    def is_new(self, candidate: Candidate) -> bool:
        before = len(self._asked)
        self._asked.add(repr(candidate))
        return len(self._asked) > before

    def randomly(self) -> Candidate:
        settings = tuple(self.rng.random() for _ in range(self.space.dimensions))
        return Candidate(self._losses(), self.space.faults.randomly(self.rng), settings)

    def _losses(self) -> tuple[tuple[LinkName, Pattern], ...]:
        """Draw a pattern for each link, or one for all links of a sender, or one for all."""
        space, shared = self.space, self.rng.random()
        patterns: dict[object, Pattern] = {}
        found: dict[LinkName, Pattern] = {}
        for link, frames in space.frames.items():
            limits = space.budget.losses[link]
            group: object = (limits, frames) if shared < 0.3 else (limits, frames, link[:2]) if shared < 0.6 else link
            if group not in patterns:
                patterns[group] = randomly(frames, limits, self.rng)
            found[link] = patterns[group]
        return _kept(found)


class Evolution(RandomSearch):
    """The search of `marconet break`; `runs` is the number of candidates that will be run in all."""

    def __init__(self, space: Space, runs: int, seed: int) -> None:
        super().__init__(space, seed)
        self._continuous = Continuous(space.dimensions, SIZE, seed)
        self._elite: list[tuple[float, int, int, Candidate]] = []       # cost, size, number
        self._told = 0
        self._starts = islice(_interleaved(self._extremal(), self._single_faults()),
                              max(1, int(runs * EXTREMAL_SHARE)))

    def ask(self) -> list[Candidate]:
        found = []
        for start in self._starts:
            if self.is_new(start):
                found.append(start)
            if len(found) == SIZE:
                break
        while len(found) < SIZE:
            found.append(self.new(self._next))
        if not self.space.dimensions:
            return found
        return [Candidate(candidate.losses, candidate.faults, settings)
                for candidate, settings in zip(found, self._continuous.ask(), strict=True)]

    def tell(self, costs: Sequence[tuple[float, Candidate]]) -> None:
        if self.space.dimensions and len(costs) == SIZE:
            self._continuous.tell([cost for cost, _ in costs])
        for cost, candidate in costs:
            self._elite.append((cost, candidate.size, self._told, candidate))
            self._told += 1
        self._elite = sorted(self._elite, key=lambda entry: entry[:3])[:MU]

    def _next(self) -> Candidate:
        if not self._elite or self.rng.random() < RANDOM_SHARE:
            return self.randomly()
        # The better of two of the best: a tournament.
        place = min(int(self.rng.random() * len(self._elite)) for _ in range(2))
        return self._mutant(self._elite[place][3])

    def _mutant(self, parent: Candidate) -> Candidate:
        rng, space = self.rng, self.space
        losses, faults = dict(parent.losses), parent.faults
        both = bool(space.frames) and not space.faults.empty
        if not space.faults.empty and (not both or rng.random() < 0.6):
            faults = space.faults.mutated(faults, rng)
        if space.frames and (not both or rng.random() < 0.6):
            links = list(space.frames)
            choice = rng.random()
            if choice < 0.2:
                other = dict(self._elite[int(rng.random() * len(self._elite))][3].losses)
                losses = {link: crossed(losses.get(link, ()), other.get(link, ()), space.frames[link],
                                        space.budget.losses[link], rng) for link in links}
            elif choice < 0.35:         # the pattern of one link for another one
                one, other_link = (links[int(rng.random() * len(links))] for _ in range(2))
                if space.budget.losses[one] == space.budget.losses[other_link]:
                    losses[other_link] = tuple(n for n in losses.get(one, ()) if n < space.frames[other_link])
            else:
                share = rng.random() ** 2
                chosen = [link for link in links if rng.random() < share] or [links[int(rng.random() * len(links))]]
                for link in chosen:
                    losses[link] = mutated(losses.get(link, ()), space.frames[link], space.budget.losses[link], rng)
        return Candidate(_kept(losses), faults, parent.settings)

    def _extremal(self) -> Iterator[Candidate]:
        """Yield patterns that use the limits up, the same phase on all links of a group."""
        frames, limits = self.space.frames, self.space.budget.losses
        patterns = {link: list(extremal(count, limits[link])) for link, count in frames.items()}
        senders = dict.fromkeys(link[:2] for link in frames)
        receivers = dict.fromkeys((link[0], link[2]) for link in frames)
        groups = [list(frames), *([link for link in frames if link[:2] == sender] for sender in senders),
                  *([link for link in frames if (link[0], link[2]) == receiver] for receiver in receivers),
                  *([link] for link in frames)]
        for phase in range(max(map(len, patterns.values()), default=0)):
            for group in groups:
                yield Candidate(_kept({link: patterns[link][phase % len(patterns[link])] for link in group}))

    def _single_faults(self) -> Iterator[Candidate]:
        for choice in self.space.faults.choices:
            yield Candidate((), self.space.faults.compatible([self.space.faults.draw(self.rng, choice)]))


def _interleaved(one: Iterator[Candidate], other: Iterator[Candidate]) -> Iterator[Candidate]:
    waiting = [one, other]
    while waiting:
        turn = waiting.pop(0)
        candidate = next(turn, None)
        if candidate is not None:
            yield candidate
            waiting.append(turn)


def _kept(losses: dict[LinkName, Pattern]) -> tuple[tuple[LinkName, Pattern], ...]:
    return tuple((link, pattern) for link, pattern in sorted(losses.items()) if pattern)
