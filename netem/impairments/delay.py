"""Delay: a copy arrives later by a constant or random time (`tc netem delay TIME JITTER CORRELATION distribution ...`).

    delay[k] = max(0, round(delay_ns + jitter_ns * q(u[k])))  [ns]      q: see delay_quantiles
    empirical: delay[k] = round(delay_ns + Q(u[k])), Q from samples, quantiles or a file

u[k] is uniform, with lag-1 rank correlation `correlation` (see correlated_uniforms); the distribution stays exact.
Negative delays are cut at 0, which puts the probability q^-1(-delay_ns/jitter_ns) there and raises the mean.
Jitter reorders copies, as in Linux netem. With `keep_order` a copy that would overtake an earlier one arrives together
with it, also after the end of a time window.

Not modelled: delay that depends on frame length (see `rate_limit`) or on time (see `trace`).
Differs from Linux netem: without `distribution` there is no jitter (netem takes uniform).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from random import Random
from typing import ClassVar, Literal

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_at_least, expect_correlation
from netem.impairments.correlated_uniforms import LARGEST, correlated_uniforms
from netem.impairments.csv_text import RecordingError
from netem.impairments.delay_quantiles import JITTER_QUANTILES, Quantile, of_points, of_samples
from netem.impairments.flow import Flow
from netem.impairments.order import not_before
from netem.impairments.recordings import Recordings


@dataclass
class Delay(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    only_delays: ClassVar[bool] = True

    delay_ns: int = 0                                   # >= 0
    distribution: Literal["constant", "uniform", "normal", "pareto", "paretonormal", "empirical"] = "constant"
    jitter_ns: int = 0                                  # half width of "uniform", otherwise standard deviation
    correlation: float = 0.0                            # rank correlation of successive delays, in (-1, 1)
    samples_ns: list[int] = field(default_factory=list)     # empirical: values, each equally likely
    quantiles_ns: list[int] = field(default_factory=list)   # empirical: at equally spaced probabilities from 0 to 1
    file: str = ""                                      # empirical: CSV with delay_s (samples), or also probability
    keep_order: bool = False
    columns: dict[str, str] = field(default_factory=dict)   # name with unit -> name that `file` has instead
    rng: Random = field(kw_only=True)
    recordings: Recordings = field(default_factory=Recordings, kw_only=True, repr=False, compare=False)

    def __post_init__(self) -> None:
        expect_at_least("delay_ns", self.delay_ns, 0)
        expect_at_least("jitter_ns", self.jitter_ns, 0)
        expect_correlation(self.correlation)
        if self.columns and not self.file:
            raise ValueError(f"columns={self.columns}: these are names in a file, and there is no `file`")
        sources = [name for name in ("samples_ns", "quantiles_ns", "file") if getattr(self, name)]
        self._draw = correlated_uniforms(self.rng, self.correlation)
        self._quantile: Quantile | None = None
        self._latest_ns = 0
        if self.distribution == "empirical":
            if len(sources) != 1:
                raise ValueError(f"distribution=empirical with {' and '.join(sources) or 'no values'}: "
                                 "give one of samples_ns, quantiles_ns, file")
            if self.jitter_ns:
                raise ValueError(f"jitter_ns={self.jitter_ns}: an empirical delay has its jitter in its values")
            self._quantile = self._empirical()
            return
        if sources:
            raise ValueError(f"{sources[0]}: belongs to distribution=empirical, here it is {self.distribution}")
        if self.distribution == "constant":
            if self.jitter_ns or self.correlation:
                raise ValueError(f"jitter_ns={self.jitter_ns}, correlation={self.correlation}: a constant delay "
                                 f"has none: choose distribution = {', '.join(JITTER_QUANTILES)}")
        elif self.distribution not in JITTER_QUANTILES:
            raise ValueError(f"distribution={self.distribution}: expected constant, {', '.join(JITTER_QUANTILES)} or "
                             "empirical")
        elif self.jitter_ns == 0:
            raise ValueError(f"jitter_ns=0: a {self.distribution} delay needs jitter_ns > 0")
        else:
            self._quantile = scaled(JITTER_QUANTILES[self.distribution], self.jitter_ns)

    def carry(self, transit: Transit) -> Iterator[Transit]:
        delay_ns = self.delay_ns
        if self._quantile is not None:
            delay_ns = max(0, round(delay_ns + self._quantile(self._draw())))
        arrival_ns = transit.arrival_ns + delay_ns
        if self.keep_order:
            arrival_ns = self._latest_ns = max(arrival_ns, self._latest_ns)
        yield replace(transit, arrival_ns=arrival_ns)

    def written_out(self) -> bool:
        """A constant delay stays whole."""
        return self._quantile is not None

    def carry_outside(self, transit: Transit) -> Transit:
        """With `keep_order`, delay a copy from outside the time window until it overtakes none from inside."""
        return not_before(transit, self._latest_ns)

    def least_delay_ns(self, size_bytes: int) -> int:
        """The shortest delay that can be drawn."""
        return max(0, round(self.delay_ns + (self._quantile(0.0) if self._quantile is not None else 0)))

    def most_delay_ns(self, flow: Flow) -> int:
        """The longest delay that can be drawn; `keep_order` makes no copy later than that."""
        return max(0, round(self.delay_ns + (self._quantile(LARGEST) if self._quantile is not None else 0)))

    def _empirical(self) -> Quantile:
        if self.file:
            key = ("delay", self.file, tuple(sorted(self.columns.items())))
            return self.recordings.once(key, lambda: _from_file(self.file, self.columns))
        name, values = ("samples_ns", self.samples_ns) if self.samples_ns else ("quantiles_ns", self.quantiles_ns)
        if min(values) < 0:
            raise ValueError(f"{name}: {min(values)} is negative: a delay is >= 0")
        if name == "samples_ns":
            return of_samples(values)
        if len(values) < 2 or sorted(values) != values:
            raise ValueError(f"quantiles_ns={values}: expected two or more values that do not fall")
        return of_points([i / (len(values) - 1) for i in range(len(values))], values)


def scaled(quantile: Quantile, by_ns: int) -> Callable[[float], float]:
    return lambda u: by_ns * quantile(u)


def _from_file(file: str, names: Mapping[str, str]) -> Quantile:
    from netem.impairments.csv_columns import read_columns  # late: it imports numpy

    columns = read_columns(file, times=["delay"], ratios=["probability"], columns=names)
    if "delay" not in columns.times_ns:
        raise RecordingError(f"{file}: no column delay_s, delay_ms, delay_us or delay_ns, and no `columns` that says "
                             f"what it is called; there are {columns.text.there}")
    delays_ns = array("q", columns.times_ns["delay"].astype("=i8").tobytes())
    if "probability" not in columns.ratios:
        return of_samples(delays_ns)
    points = columns.ratios["probability"].tolist()
    if len(points) < 2 or (points[0], points[-1]) != (0, 1) or any(b <= a for a, b in pairwise(points)):
        raise RecordingError(f"{file}: probability: expected two or more values that rise from 0 to 1")
    if any(b < a for a, b in pairwise(delays_ns)):
        raise RecordingError(f"{file}: delay: quantiles do not fall while probability rises")
    return of_points(points, delays_ns)
