"""Resynchronization of slot clocks from the frames that arrive: no extra messages, no master.

A receiver knows when, on its own clock, the frame of a slot should have begun (`SlottedBroadcast.data_ns`) and when it
did (arrival - airtime - latency). The difference is the lead of its clock over the sender's. The receiver collects
these errors over a round, then makes one bounded step towards the mean (or median) of the clocks that it heard:

    x_i <- x_i - clip(gain * mean_{j heard} (x_i - x_j), bound)          x_i: offset of clock i

Convergence: without the bound this is x <- W x, W = (1 - gain) I + gain A, where row i of A averages over the nodes
that i hears. W is row stochastic, with a positive diagonal for 0 < gain < 1. If the directed graph of hearing is
strongly connected, W is primitive, so W^k -> 1 pi' (Perron-Frobenius): all clocks converge to pi' x(0), at the rate of
the second largest |eigenvalue| of W. A root with paths to all nodes suffices: all clocks converge to that of a
reference node (row of the identity in W). With lost frames W changes from round to round; the clocks still converge if
the unions of the graphs over windows of bounded length have a root (Moreau 2005). `slot_sync_condition` computes the
rate.

Drifts add drift * round per round, so steps alone leave a bounded difference (`slot_drift.largest_drift_ppm`). The rate
trim, `rate_gain` times the step per round, removes it, but is a second integrator: on long one-way rings even a small
`rate_gain` is unstable. Check with `slot_sync_condition` before using it. A step that the bound clips does not measure
the rate, so it causes no trim.

A clock that a fault has stepped is further off than any drift explains: from `far_ns` on a step has no bound, so that
x <- W x holds again and the clocks come together at the rate of W, however far apart they were, as long as frames still
get through. Without a rate trim, as such a step does not measure the rate either.

A node closes its round at the round's end on the local clock, or at its own slot just after sending. With the second,
the node's promise need not allow for the step, but errors are up to a round old: with steps alone the clocks still
converge, a rate trim has to be smaller (`slot_sync_condition`, `own_slot=True`). With the first, a step forward beyond
the guard would skip the start of the first slot, so its owners would not send: bound <= guard.

Source: Simeone, Spagnolini, Bar-Ness & Strogatz, "Distributed synchronization in wireless networks", IEEE Signal
Processing Magazine 25(5), 2008 (coupled clocks, condition on the graph); Schenato & Fiorentin, "Average TimeSynch",
Automatica 47(9), 2011 (rates); Carli, Chiuso, Schenato & Zampieri, "A PI consensus controller for networked clocks
synchronization", IFAC World Congress 2008; Moreau, IEEE Trans. Automatic Control 50(2), 2005 (changing graphs).
Not modelled: unknown latency (if it is the same everywhere, all clocks slow down together and keep their slots; with
a reference there is a steady error); airtime is taken as local time (an error of drift * airtime); first contact of
clocks that differ by half a round or more.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from statistics import fmean, median
from typing import NamedTuple


class Average(Enum):
    MEAN = "mean"
    MEDIAN = "median"           # insensitive to one broken clock of three; its convergence is not proved


class Correction(NamedTuple):
    step_ns: int                # for LocalClock.adjust
    trim_ppm: float             # for LocalClock.trim


@dataclass
class SlotSync:
    bound_ns: int                       # largest step per round, at most the guard (see the module's docstring)
    gain: float = 0.5                   # 0 < gain < 1
    rate_gain: float = 0.0              # >= 0; 0: steps alone
    average: Average = Average.MEAN
    reference: bool = False             # True: the node never corrects its clock
    far_ns: int = 0                     # mean error from which a step has no bound; 0: every step has
    errors_ns: dict[str, int] = field(default_factory=dict, init=False)   # sender -> lead of this node's clock

    def __post_init__(self) -> None:
        if self.bound_ns < 1:
            raise ValueError(f"bound_ns={self.bound_ns}: a round's correction needs room for at least 1 ns")
        if not 0 < self.gain < 1:
            raise ValueError(f"gain={self.gain}: expected 0 < gain < 1; at 1 two nodes swap their clocks for ever")
        if not 0 <= self.rate_gain < 2:
            raise ValueError(f"rate_gain={self.rate_gain}: expected 0 <= rate_gain < 2")

    def heard(self, sender: str, expected_ns: int, arrived_ns: int, airtime_ns: int, latency_ns: int = 0) -> None:
        """Note the arrival of a frame of `sender`, in local time; of several the earliest, least delayed one counts."""
        error_ns = arrived_ns - airtime_ns - latency_ns - expected_ns
        self.errors_ns[sender] = min(error_ns, self.errors_ns.get(sender, error_ns))

    def close_round(self, round_ns: int) -> Correction:
        """Return the correction of the clock, and drop the errors of this round."""
        errors_ns = list(self.errors_ns.values())
        self.errors_ns.clear()
        if self.reference or not errors_ns:
            return Correction(0, 0.0)
        error_ns = fmean(errors_ns) if self.average is Average.MEAN else median(errors_ns)
        step_ns = round(-self.gain * error_ns)
        if 0 < self.far_ns <= abs(error_ns):
            return Correction(step_ns, 0.0)
        if abs(step_ns) > self.bound_ns:
            return Correction(self.bound_ns if step_ns > 0 else -self.bound_ns, 0.0)
        return Correction(step_ns, self.rate_gain * step_ns / round_ns * 1e6)
