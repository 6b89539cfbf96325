"""`marconet shrink`: finds the few faults and changed frames of a run, and its least length, that still make it fail.

    run --repeated, traced--> faults, losses, delays, flipped bits, each an entry --> does it still fail?
        --ddmin--> the few entries --bisection--> length --> a scenario

Delta debugging goes over the entries of the scenario first, then over what the remaining ones did, as Misherghi and Su
(2006, "HDD: hierarchical delta debugging") do with the levels of a tree. A subset fails if the same expectation is
broken, or, of a run that failed, if it fails by the same error. A length is taken only if the run without any of them
holds at that length: otherwise a figure such as a number of frames would be too small for the reason alone that the run
is short.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import msgspec

from experiments.judge.figures import Figures
from experiments.judge.run_files import SCENARIO, SUMMARY
from experiments.judge.run_result import Summary
from experiments.run.network import is_written_out
from experiments.run.repeat import made_with
from experiments.scenario.blocking_programs import repeating_host
from experiments.scenario.metric_keys import GUARANTEE
from experiments.scenario.problems import ScenarioError, path_text
from experiments.scenario.units import siblings
from experiments.search.base import Base, NoPlace, Tables, toml_of
from experiments.search.ddmin import ddmin
from experiments.search.explicit import Explicit, Item
from experiments.sweep.messages import TRACED, Host, Point
from experiments.sweep.workers import Workers
from netem.impairments.traced import Watched

LENGTH_STEP: Final = 0.05               # of the run: as exactly is the shortest length found
NUMBER: Final = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")

Progress = Callable[[], None]           # after each run


class CannotShrink(ValueError):
    """A run has nothing that fails, or fails no more in its explicit form."""

    exit_code = 2


class _NoRunsLeft(Exception):
    pass


@dataclass
class Shrunk:
    """`expectation` still fails, "" if the run itself does, with `kept` of `items`. `minimal`: it came to its end."""

    expectation: str
    kept: tuple[Item, ...]
    items: tuple[Item, ...]
    length_ns: int
    full_length_ns: int
    runs: int
    minimal: bool
    file: Path
    lines: list[str] = field(default_factory=list)


def shrink(folder: Path, most_runs: int = 500, out: Path | None = None, expectation: str = "",
           progress: Progress = lambda: None) -> Shrunk:
    """Return the smallest cause of the failure of the run in `folder`; its scenario is written to `out`.

    Raises CannotShrink, NoPlace or ScenarioError, before or after the first run, and writes nothing then.
    """
    if most_runs < 1:
        raise CannotShrink(f"--runs {most_runs}: expected at least 1")
    base, broken = _base_of(folder, expectation)
    file = _place(base, out)
    scenario = base.scenario
    host: Host = repeating_host(scenario)
    with Workers(base.source, host, 1) as workers:
        changes = any(is_written_out(scenario, spec) for spec in scenario.impairments) or any(
            spec.settings.flips for spec in scenario.faults)
        watched = _trace(workers, scenario.seed) if changes else []
        progress()
        search = _Search(base, broken, Explicit(scenario, base.tables, watched), workers, most_runs, progress)
        search.runs += changes
        return search.run(file)


def _trace(workers: Workers, seed: int) -> list[Watched]:
    """Repeat the run, and return what its impairments did to each copy."""
    with TemporaryDirectory(prefix="marconet-") as made:
        folder = Path(made) / "run"
        (_, figures), = workers.evaluate([Point(0, {}, seed, str(folder), traced=True)])
        try:
            return msgspec.msgpack.decode((folder / TRACED).read_bytes(), type=list[Watched])
        except OSError:
            raise CannotShrink(f"the run ends its process when it is repeated: {figures.failure}: nothing can tell "
                               "what its impairments did") from None


def _base_of(folder: Path, expectation: str) -> tuple[Base, str]:
    """Return the scenario of a run, and the expectation that it broke, "" if it failed."""
    try:
        old: dict[str, Any] = SCENARIO.read(folder)
        summary = msgspec.convert(SUMMARY.read(folder), Summary)
    except (OSError, msgspec.MsgspecError) as error:
        raise CannotShrink(f"{folder}: cannot read {SCENARIO.name} and {SUMMARY.name} of a run there: {error}: name "
                           "the folder of a run") from None
    failing = [verdict.key for verdict in summary.verdicts if not verdict.holds]
    if expectation and expectation not in failing:
        raise CannotShrink(f"--expect {expectation}: holds in {folder}, or is not there; "
                           f"{', '.join(failing) or 'none'} {'do' if len(failing) > 1 else 'does'} not hold")
    if not failing and not summary.failure:
        raise CannotShrink(f"{folder}: every expectation holds, so there is no failure to make smaller")
    made = made_with(folder)
    if made.fates_of:
        raise CannotShrink(f"{folder}: met the fates of {made.fates_of} instead of impairments: make traces of that "
                           "run by `marconet export`, run the scenario with them, and shrink that")
    base = Base.of(made.path, values=made.changes)
    told = {"changes": None}                # in which injected faults are among those of the file, or not
    if difference := _difference(old | told, base.scenario.resolved() | told):
        raise CannotShrink(f"{folder}: its {difference} is not what {made.path.name} says now: run the file again, as "
                           "it has changed since")
    return base, "" if summary.failure and not expectation else expectation or failing[0]


def _difference(old: Any, new: Any, place: tuple[str | int, ...] = ()) -> str:
    """Return the path of the first value that differs, "" if none does."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys((*old, *new)):
            if found := _difference(old.get(key), new.get(key), (*place, key)):
                return found
        return ""
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        return next((found for number, (one, other) in enumerate(zip(old, new, strict=True))
                     if (found := _difference(one, other, (*place, number)))), "")
    return "" if old == new else path_text(place)


def _place(base: Base, out: Path | None) -> Path:
    if out is None:
        return base.place("small", None)
    if out.suffix != ".toml":
        raise NoPlace(f"--out {out}: expected the name of a scenario, which ends in .toml")
    if problem := base.loads_in(out.parent):
        raise NoPlace(f"--out {out}: {base.path.name} does not load from there: {problem}: name a file in "
                      f"{base.path.parent}")
    return out


class _Search:
    def __init__(self, base: Base, broken: str, explicit: Explicit, workers: Workers, most_runs: int,
                 progress: Progress) -> None:
        self.base = base
        self.broken = broken
        self.explicit = explicit
        self.runs = 0
        self._workers = workers
        self._most_runs = most_runs
        self._progress = progress
        self._known: dict[tuple[frozenset[Item], int], bool] = {}
        self._failure = ""                      # how the explicit form fails, without its numbers
        self._unvalued = False                  # whether the explicit form has no such figure, which breaks it too
        self._kept = explicit.items
        self._length_ns = base.scenario.length_ns

    def run(self, file: Path) -> Shrunk:
        items, full_ns = self.explicit.items, self.base.scenario.length_ns
        figures = self._figures(items, full_ns)
        self._failure = _plain(figures.failure)
        self._unvalued = figures.values.get(self.broken) is None
        what = f"expectation {self.broken}" if self.broken else "the run"
        if not self._is_same(figures):
            raise CannotShrink(
                f"{self.base.path.name}: with every drawn fault and loss written out ({len(items)} entries), {what} "
                + (f"holds: {self.broken} = {figures.values.get(self.broken)}" if self.broken and not figures.failure
                   else f"fails otherwise: {figures.failure}" if figures.failure else "does not fail")
                + ": the failure came from what is not explicit, as the noise that a fault of a sensor draws")
        minimal = True
        try:
            self._shrink()
        except _NoRunsLeft:
            minimal = False
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(self._text(what), encoding="utf-8")
        return Shrunk(self.broken, self._kept, items, self._length_ns, full_ns, self.runs, minimal, file,
                      list(self.explicit.in_words(self._kept)))

    def _shrink(self) -> None:
        full_ns = self._length_ns
        if self._fails((), full_ns):
            self._kept = ()
        else:
            self._reduce(full_ns)
        self._shorten()
        if self._kept and self._length_ns < full_ns:
            self._reduce(self._length_ns)

    def _reduce(self, length_ns: int) -> None:
        """Leave out what can be left out at this length."""
        def fails(items: tuple[Item, ...]) -> bool:
            found = self._fails(items, length_ns)
            if found and len(items) < len(self._kept):
                self._kept = items
            return found

        sources: dict[str, list[Item]] = {}
        for item in self._kept:
            sources.setdefault(item.source, []).append(item)
        if 1 < len(sources) < len(self._kept):
            ddmin([tuple(items) for items in sources.values()], lambda found: fails(
                tuple(sorted(chain.from_iterable(found), key=lambda item: item.at_ns))))
        ddmin(self._kept, fails)

    def _shorten(self) -> None:
        """Halve the range of lengths until it is LENGTH_STEP of the run; each that fails is the new upper end."""
        step_ns = max(1, int(self._length_ns * LENGTH_STEP))
        low_ns = max((item.at_ns for item in self._kept), default=0)
        while self._length_ns - low_ns > step_ns:
            middle_ns = _rounded((low_ns + self._length_ns) // 2, step_ns)
            if not low_ns < middle_ns < self._length_ns:
                break
            if self._fails(self._kept, middle_ns) and (not self._kept or not self._fails((), middle_ns)):
                self._length_ns = middle_ns
            else:
                low_ns = middle_ns

    def _fails(self, items: tuple[Item, ...], length_ns: int) -> bool:
        key = (frozenset(items), length_ns)
        if key not in self._known:
            try:
                self.base.source.load(self._values(items, length_ns))
            except ScenarioError:               # as of a formula that looks beyond this end
                self._known[key] = False
            else:
                if self.runs >= self._most_runs:
                    raise _NoRunsLeft
                self._known[key] = self._is_same(self._figures(items, length_ns))
        return self._known[key]

    def _figures(self, items: tuple[Item, ...], length_ns: int) -> Figures:
        self.runs += 1
        point = Point(0, self._values(items, length_ns), self.base.scenario.seed)
        (_, figures), = self._workers.evaluate([point])
        self._progress()
        return figures

    def _is_same(self, figures: Figures) -> bool:
        if figures.failure:
            return not self.broken and _plain(figures.failure) == self._failure
        return self.broken in figures.broken and (figures.values[self.broken] is None) == self._unvalued

    def _values(self, items: tuple[Item, ...], length_ns: int) -> dict[str, Any]:
        return {**self.explicit.entries(items), "length_s": length_ns / 1e9, **self._judged()}

    def _judged(self) -> Tables:
        """Return `expect` with the one expectation alone, and the guarantees if it is about one."""
        expected = self.base.tables.get("expect", {})
        kept: Tables = {"expect": {self.broken: expected[self.broken]} if self.broken in expected else {}}
        return kept if self.broken.startswith(f"{GUARANTEE}.") else kept | {"guarantees": {}}

    def _text(self, what: str) -> str:
        values = self._values(self._kept, self._length_ns)
        tables = {key: value for key, value in self.base.tables.items() if key not in siblings("length_s")} | values
        tables = {key: tables.pop(key) for key in ("seed", "length_s") if key in tables} | tables
        told = (f"The smallest cause that `marconet shrink` found, in {self.runs} runs, by which {what} fails:\n"
                f"{len(self._kept)} of {len(self.explicit.items)} faults, losses and other changes of frames.\n")
        return toml_of(tables, told, self.base.question)


def _plain(failure: str) -> str:
    """Return the first line of an error without its numbers, such as instants, which differ from run to run."""
    return NUMBER.sub("#", failure.splitlines()[0]) if failure else ""


def _rounded(time_ns: int, step_ns: int) -> int:
    """Round to a tenth of the step's decade, so that a reader can read the length."""
    grid_ns = max(1, 10 ** (len(str(step_ns)) - 2))
    return int(round(time_ns / grid_ns) * grid_ns)
