"""Estimates the clock of a device outside from exchanges with it: its offset, its drift, and bounds of their errors.

    t1: a question leaves;  T: the device's clock when it answers;  t4: the answer arrives
    offset  = T - (t1 + t4) / 2          |error| <= (t4 - t1) / 2

The device stamps at an instant s in [t1, t4], so the error is s - (t1 + t4) / 2 = (delay out - delay back) / 2: half of
the asymmetry of the delays, which is at most half of the exchange, however asymmetric it is.

Of each group of GROUP exchanges the shortest is kept (the clock filter of Mills et al. 2010, RFC 5905, section 10), as
a queue makes an exchange longer and its offset worse. A line is fitted to the kept offsets by least squares; drift is
its slope. With w_i the weight of an offset in a result, linear in the offsets, and e_i its bound, the bound of the
result is the sum of |w_i| e_i. It holds if the drift is constant over the KEPT groups. A single offset, whose bound
grows by MOST_DRIFT_PPM with its age, is taken instead while its bound is the smaller one.

A device's clock that was set is taken for a new one, if an offset contradicts the line and both bounds by STEP_NS.

Not modelled: drift that changes with temperature, which adds to the error but not to the bound.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import inf, nan
from typing import Final, NamedTuple

GROUP: Final = 8                    # exchanges of which the shortest is kept
KEPT: Final = 64                    # groups that the line goes through
MOST_DRIFT_PPM: Final = 200         # of any device, as long as its drift is not known
STEP_NS: Final = 10_000_000


class Estimate(NamedTuple):
    """A device's clock minus the run's, its drift against the run's clock, and bounds of their errors.

    The drift is nan and its bound infinite as long as there is one group only.
    """

    offset_ns: float
    offset_bound_ns: float
    drift_ppm: float
    drift_bound_ppm: float


class _Sample(NamedTuple):
    at_ns: int
    offset_ns: float                # minus the reference of the estimate
    bound_ns: float


@dataclass
class ClockEstimate:
    """Times are ns of the run's clock, stamps ns of the device's clock, whose origin is arbitrary."""

    steps: int = 0                  # how often the device's clock was set
    _reference_ns: int = 0          # an offset near those of the samples, so that floats keep the ns
    _kept: deque[_Sample] = field(default_factory=lambda: deque(maxlen=KEPT))
    _group: list[_Sample] = field(default_factory=list)

    def exchanged(self, asked_ns: int, stamp_ns: int, answered_ns: int) -> Estimate:
        """Take an exchange; return the estimate at `answered_ns`. Raises ValueError for an answer before its question.
        """
        if answered_ns < asked_ns:
            raise ValueError(f"answered_ns={answered_ns}: expected an answer after the question at {asked_ns} ns")
        return self._take((asked_ns + answered_ns) // 2, stamp_ns, (answered_ns - asked_ns) / 2, answered_ns)

    def stamped(self, stamp_ns: int, arrived_ns: int, most_delay_ns: int) -> Estimate:
        """Take a message with the time of sending by the device's clock, such as a Zenoh timestamp.

        It was under way for at most `most_delay_ns`, as for the longest exchange with the same device. As it was sent
        in [arrived_ns - most_delay_ns, arrived_ns], it counts as an exchange of this length.
        """
        return self.exchanged(arrived_ns - most_delay_ns, stamp_ns, arrived_ns)

    def _take(self, middle_ns: int, stamp_ns: int, bound_ns: float, now_ns: int) -> Estimate:
        if not self._kept and not self._group:
            self._reference_ns = stamp_ns - middle_ns
        sample = _Sample(middle_ns, float(stamp_ns - middle_ns - self._reference_ns), bound_ns)
        if self._kept or self._group:
            expected = self._at(middle_ns)
            away_ns = abs(expected.offset_ns - self._reference_ns - sample.offset_ns)
            if away_ns > bound_ns + expected.offset_bound_ns + STEP_NS:
                self._kept.clear()
                self._group.clear()
                self.steps += 1
                self._reference_ns = stamp_ns - middle_ns
                sample = _Sample(middle_ns, 0.0, bound_ns)
        self._group.append(sample)
        if len(self._group) == GROUP:
            self._kept.append(_shortest(self._group))
            self._group.clear()
        return self._at(now_ns)

    def _at(self, now_ns: int) -> Estimate:
        samples = [*self._kept, *([_shortest(self._group)] if self._group else [])]
        best_ns, offset_ns = min((sample.bound_ns + abs(now_ns - sample.at_ns) * MOST_DRIFT_PPM * 1e-6,
                                  sample.offset_ns) for sample in [*self._kept, *self._group])
        middle_ns = sum(sample.at_ns for sample in samples) / len(samples)
        spread = sum((sample.at_ns - middle_ns) ** 2 for sample in samples)
        if not spread:
            return Estimate(offset_ns + self._reference_ns, best_ns, nan, inf)
        slopes = [(sample.at_ns - middle_ns) / spread for sample in samples]
        weights = [1 / len(samples) + (now_ns - middle_ns) * slope for slope in slopes]
        bound_ns = sum(abs(weight) * sample.bound_ns for weight, sample in zip(weights, samples, strict=True))
        if bound_ns <= best_ns:
            best_ns = bound_ns
            offset_ns = sum(weight * sample.offset_ns for weight, sample in zip(weights, samples, strict=True))
        drift = sum(slope * sample.offset_ns for slope, sample in zip(slopes, samples, strict=True))
        drift_bound = sum(abs(slope) * sample.bound_ns for slope, sample in zip(slopes, samples, strict=True))
        return Estimate(offset_ns + self._reference_ns, best_ns, drift * 1e6, drift_bound * 1e6)


def _shortest(samples: list[_Sample]) -> _Sample:
    return min(samples, key=lambda sample: sample.bound_ns)
