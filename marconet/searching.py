"""Searches from Python: the worst pattern of losses and faults within a budget, and the smallest cause of a failure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from marconet.running import Run
from marconet.scenario import Scenario, load, plain_values
from marconet.sweeping import file_of

if TYPE_CHECKING:
    from experiments.search.falsify import Found
    from experiments.search.shrink import Shrunk


class Worst:
    """The worst that a search has found. `file` is the scenario that repeats it; None if nothing was worse than none.

    `value` is that of the figure or the robustness of the formula, `without` that without losses and faults. `pattern`
    has a line for each link that loses frames, each fault and each varied setting. `costs` has what each run came to:
    the value, negated for `maximize`; -inf for a run that failed, inf for one without such a figure.
    """

    def __init__(self, found: Found, figure: str) -> None:
        self.figure = figure
        self.file: Path | None = found.file
        self.value = found.value
        self.without = found.without
        self.pattern: list[str] = list(found.lines)
        self.costs: list[float] = list(found.costs)
        self.warnings: list[str] = list(found.warnings)
        self.failure: str = found.figures.failure
        self.holds: bool = found.figures.holds

    @property
    def scenario(self) -> Scenario | None:
        """The scenario in `file`."""
        return None if self.file is None else load(self.file)

    def __repr__(self) -> str:
        if self.file is None:
            return f"<marconet.Worst: {self.figure} is {self.without:.6g}, and nothing worse in {len(self.costs)} runs>"
        what = f"the run fails: {self.failure}" if self.failure else \
            f"{self.figure} is {self.value:.6g}, {self.without:.6g} without"
        return f"<marconet.Worst of {len(self.costs)} runs: {what}; scenario {self.file}>"


class Smallest:
    """The smallest cause of a failure. `file` is the scenario with it: `expectation` still fails there.

    `expectation` is "" if the run itself fails. `kept` has a line for each fault, loss, delay, duplicate and corruption
    that is left of `of`. `minimal` is False if the runs were used up before it was clear that nothing more can go.
    """

    def __init__(self, shrunk: Shrunk) -> None:
        self.file: Path = shrunk.file
        self.expectation = shrunk.expectation
        self.kept: list[str] = list(shrunk.lines)
        self.of = len(shrunk.items)
        self.length_s = shrunk.length_ns / 1e9
        self.runs = shrunk.runs
        self.minimal = shrunk.minimal

    @property
    def scenario(self) -> Scenario:
        """The scenario in `file`."""
        return load(self.file)

    def __repr__(self) -> str:
        return (f"<marconet.Smallest: {self.expectation or 'the run'} fails with {len(self.kept)} of {self.of}, in "
                f"{self.length_s:.9g} s; scenario {self.file}>")


def break_scenario(scenario: Scenario | str | PurePath, budget: str | Iterable[str] = (), *,
                   minimize: str | None = None, maximize: str | None = None, vary: Mapping[str, str] | None = None,
                   runs: int = 200, jobs: int | None = None, seed: int = 0,
                   set: Mapping[str, Any] | None = None, length_s: float | None = None,     # as of `load`
                   out: str | PurePath | None = None) -> Worst:
    """Search the worst pattern of losses and faults within the budget, and write it as a scenario into `out`.

    `budget` is a text of `--budget`, as "radio: * -> *: at most 2 lost in a row" or "faults: at most 3", or several.
    Exactly one of `minimize` and `maximize` has a formula, the key of a figure or a key of `[expect]`. `vary` maps keys
    to ranges, as "0:0.4". `seed` is the search's own; the result is the same for any number of `jobs`. The scenario has
    to be that of a file, as other processes load it.

    Raises ScenarioError or ValueError before the search; a run that fails is worse than any figure.
    """
    from experiments.search.base import Base
    from experiments.search.falsify import Wanted, falsify
    from experiments.search.objective import Objective
    from experiments.sweep.vary import parse

    path, changes = file_of(scenario, "a search")
    changes |= plain_values(dict(set or {})) | ({} if length_s is None else {"length_s": length_s})
    base = Base.of(path, values=changes)
    objective = Objective.of_either(minimize, maximize, base)
    found = falsify(Wanted(base, [budget] if isinstance(budget, str) else list(budget), objective, runs,
                           [parse(f"{key}={values}") for key, values in (vary or {}).items()], seed, jobs,
                           None if out is None else Path(out)))
    return Worst(found, objective.text)


def shrink(run: Run | str | PurePath, *, runs: int = 500, expect: str = "",
           out: str | PurePath | None = None) -> Smallest:
    """Find the few faults, losses, delays and flipped bits that make a run fail, and write them as the scenario `out`.

    `run` is a `Run` or the folder of one; `expect` is the expectation that has to fail, by default the first that does,
    or the failure of the run. `runs` is the largest number of runs that this may take.

    Raises ValueError if nothing fails, or fails no more in its explicit form, and ScenarioError if the scenario's file
    is not what it was.
    """
    from experiments.search import shrink as shrinking

    folder = run.folder if isinstance(run, Run) else Path(run)
    return Smallest(shrinking.shrink(folder, runs, None if out is None else Path(out), expect))
