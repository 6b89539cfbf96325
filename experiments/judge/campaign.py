"""The plan and the rows of a campaign, as its folder holds them (written by `experiments/sweep/results.py`).

A campaign runs each of `settings` with each of `seeds`; run `number` = setting * len(seeds) + the place of its seed.
Rows are read from the journal as long as there is one, up to its last whole piece, else from `runs.parquet`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import isnan, nan
from pathlib import Path
from typing import Any, Final

import msgspec

from experiments.judge.figures import Figures
from experiments.scenario.model import Bound
from experiments.scenario.problems import value_text
from experiments.scenario.toml_text import set_options
from netem.records.journal import pieces_of

CAMPAIGN: Final = "campaign.json"
RUNS: Final = "runs.parquet"
JOURNAL: Final = "runs.rows.part"
METADATA: Final = b"marconet.campaign"
FIXED: Final = ("number", "setting", "seed", "ledger_hash", "holds", "failure", "broken", "emulation_s", "whole_s")


class NoCampaign(ValueError):
    """A folder holds no campaign."""

    exit_code = 2


class Plan(msgspec.Struct, frozen=True):
    """The scenario, settings and seeds that a campaign runs.

    `bounds` are the entries of `[expect]` of its first setting; `digest` is that of the scenario's file.
    """

    scenario: str
    question: str
    path: str
    digest: str
    length_s: float | None
    overrides: tuple[str, ...]
    values: dict[str, Any]
    varied: tuple[str, ...]
    settings: tuple[dict[str, Any], ...]
    seeds: tuple[int, ...]
    host: str
    bounds: dict[str, Bound]
    sample: str = "grid"

    @property
    def runs(self) -> int:
        return len(self.settings) * len(self.seeds)

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Yield (place of the setting, seed) of each run, by number."""
        for setting in range(len(self.settings)):
            for seed in self.seeds:
                yield setting, seed

    def difference(self, other: Plan) -> str:
        """Return in what `other` is no continuation of this plan, "" if it is; it may have more seeds."""
        if (self.scenario, self.digest) != (other.scenario, other.digest):
            return f"its scenario was {self.scenario}" if self.scenario != other.scenario else \
                f"the file of {self.scenario} has changed since"
        for what, mine, its in (
                ("--duration", self.length_s, other.length_s), ("--set", self.overrides, other.overrides),
                ("set", self.values, other.values), ("--vary", self.varied, other.varied)):
            if msgspec.json.encode(mine) != msgspec.json.encode(its):
                return f"{what} was {_said(mine)}, now {_said(its)}"
        if msgspec.json.encode(self.settings) != msgspec.json.encode(other.settings):
            return f"its {len(self.settings)} settings had other values"
        if not set(self.seeds) <= set(other.seeds):
            return f"its seeds were {self.seeds[0]} to {self.seeds[-1]}, now {other.seeds[0]} to {other.seeds[-1]}"
        return ""

    def repeat(self, setting: int, seed: int) -> list[str]:
        """Return the words of the command that repeats a run with its folder."""
        sets = [word for override in self.overrides for word in ("--set", override)]
        length = [] if self.length_s is None else ["--duration", f"{self.length_s:g}"]
        host = ["--host", "inline"] if self.host == "inline" else []
        return ["marconet", "run", self.path, "--seed", str(seed), *host, *length, *sets,
                *set_options({**self.values, **self.settings[setting]})]


class Row(msgspec.Struct, frozen=True):
    number: int
    setting: int
    figures: Figures

    @property
    def seed(self) -> int:
        return self.figures.seed


@dataclass(frozen=True)
class Campaign:
    """`rows` are by number; a campaign that was interrupted has fewer than `plan.runs`."""

    folder: Path
    plan: Plan
    rows: Sequence[Row]

    @property
    def keys(self) -> list[str]:
        """The figures: those of `[expect]`, in its order, then those that only some settings have."""
        return figure_keys(self.plan, self.rows)

    def of_setting(self, setting: int) -> list[Row]:
        return [row for row in self.rows if row.setting == setting]

    def values(self, key: str, rows: Iterable[Row] | None = None) -> list[float]:
        """Return the figure of the rows that have it."""
        found = (row.figures.values.get(key) for row in (self.rows if rows is None else rows))
        return [value for value in found if value is not None and not isnan(value)]

    def margin(self, row: Row, key: str) -> float:
        """Return how far the figure is within its bounds, negative if beyond; nan without a figure or a bound.

        Of a formula that has to be satisfied it is the robustness.
        """
        value, bound = row.figures.values.get(key), self.plan.bounds.get(key)
        if value is None or bound is None:
            return nan
        gaps = [gap for gap in (None if bound.min is None else value - bound.min,
                                None if bound.max is None else bound.max - value) if gap is not None]
        return min(gaps, default=value if bound.formula else nan)

    def worst(self) -> dict[str, Row]:
        """Return, for each figure with a bound, the run with the least margin; the first of equals."""
        found = {}
        for key in self.keys:
            judged = [(self.margin(row, key), row.number, row) for row in self.rows]
            judged = [item for item in judged if not isnan(item[0])]
            if judged:
                found[key] = min(judged, key=lambda item: item[:2])[2]
        return found

    def failed(self) -> list[Row]:
        """Return the runs that do not hold: those that failed first, then by number."""
        return sorted((row for row in self.rows if not row.figures.holds),
                      key=lambda row: (not row.figures.failure, row.number))


def figure_keys(plan: Plan, rows: Iterable[Row]) -> list[str]:
    return list(dict.fromkeys([*plan.bounds, *(key for row in rows for key in row.figures.values)]))


def is_campaign(folder: Path) -> bool:
    return (folder / CAMPAIGN).is_file()


def read_plan(folder: Path) -> Plan:
    """Return the plan in `folder`; NoCampaign if there is none, or if it cannot be read."""
    try:
        return msgspec.json.decode((folder / CAMPAIGN).read_bytes(), type=Plan)
    except FileNotFoundError:
        raise NoCampaign(f"{folder}: holds no campaign: it has no {CAMPAIGN}") from None
    except (OSError, msgspec.MsgspecError) as error:
        raise NoCampaign(f"{folder}: holds no campaign that can be read: {CAMPAIGN}: {error}") from None


def load_campaign(folder: Path) -> Campaign:
    """Read a campaign, also one that was interrupted or killed."""
    plan = read_plan(folder)
    return Campaign(folder, plan, sorted(rows_of(folder), key=lambda row: row.number))


def rows_of(folder: Path) -> list[Row]:
    if (folder / JOURNAL).exists():
        decode = msgspec.msgpack.Decoder(Row).decode
        return list({row.number: row for row in map(decode, pieces_of(folder / JOURNAL))}.values())
    if not (folder / RUNS).exists():
        return []
    import pyarrow.parquet as pq

    table = pq.read_table(folder / RUNS)
    plan = read_plan(folder)
    keys = [name for name in table.column_names if name not in (*FIXED, *plan.varied)]
    return [Row(row["number"], row["setting"], Figures(
        row["seed"], row["ledger_hash"], row["holds"], {key: row[key] for key in keys}, row["broken"], row["failure"],
        row["emulation_s"], row["whole_s"])) for row in table.to_pylist()]


def _said(value: Any) -> str:
    return "not given" if not value else ", ".join(map(str, value)) if isinstance(value, tuple) else value_text(value)
