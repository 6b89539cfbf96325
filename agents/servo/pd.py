"""A PD controller with a filtered derivative of the measurement, sampled with period h.

    P(k) = K (r(k) - y(k))        D(k) = a D(k-1) + b (y(k-1) - y(k))        u(k) = P(k) + D(k)
    a = Td / (N h + Td)           b = N K a

Source: Astrom and Wittenmark 1997, Computer-Controlled Systems, section 8.5 (backward differences); TrueTime.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Pd:
    gain: float                     # K
    derivative_time_s: float        # Td
    filter: float                   # N, the largest gain of the derivative is N K
    period_s: float                 # h
    derivative: float = field(default=0.0, init=False)
    previous: float = field(default=0.0, init=False)        # y(k-1)

    def command(self, reference: float, measured: float) -> float:
        """Return u(k) for r(k) and y(k); called once a period."""
        a = self.derivative_time_s / (self.filter * self.period_s + self.derivative_time_s)
        self.derivative = a * self.derivative + self.filter * self.gain * a * (self.previous - measured)
        self.previous = measured
        return self.gain * (reference - measured) + self.derivative
