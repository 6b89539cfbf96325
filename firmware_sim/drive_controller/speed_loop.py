"""PI control of one wheel's speed with feedforward and conditional integration.

    error = expected - measured          command = feedforward reference + kp error + integral, |command| <= limit
    integral += ki error dt              unless the command is at its limit and the error has the same sign

`expected` is the reference or, with a lag, the speed of a first-order wheel with that time constant which follows the
references. Then the integral does not accumulate the wheel's own lag, which with feedforward would cause overshoot.
Source: Astrom & Hagglund 1995, PID Controllers, section 3.5 (windup; conditional integration) and 3.4 (two degrees of
freedom).
"""

from __future__ import annotations

from math import expm1, inf


class SpeedLoop:
    def __init__(self, kp: float, ki: float, feedforward: float = 1.0, limit_radps: float = inf,
                 lag_ns: int = 0) -> None:
        self.kp = kp                        # [1]
        self.ki = ki                        # [1/s]
        self.feedforward = feedforward      # [1]
        self.limit_radps = limit_radps
        self.lag_ns = lag_ns
        self.integral_radps = 0.0
        self._expected_radps = 0.0
        self._reference_radps = 0.0         # reference of the last period

    def command(self, reference_radps: float, measured_radps: float, elapsed_ns: int) -> float:
        """Return the command [rad/s] for the next period; `elapsed_ns` is the time since the last call."""
        error = self._expect(reference_radps, elapsed_ns) - measured_radps
        integral = self.integral_radps + self.ki * error * elapsed_ns / 1e9
        wanted = self.feedforward * reference_radps + self.kp * error + integral
        if not (abs(wanted) > self.limit_radps and wanted * error > 0):
            self.integral_radps = integral
        else:
            wanted = self.feedforward * reference_radps + self.kp * error + self.integral_radps
        return max(-self.limit_radps, min(self.limit_radps, wanted))

    def reset(self) -> None:
        self.integral_radps = self._expected_radps = self._reference_radps = 0.0

    def _expect(self, reference_radps: float, elapsed_ns: int) -> float:
        if not self.lag_ns:
            return reference_radps
        self._expected_radps -= (self._reference_radps - self._expected_radps) * expm1(-elapsed_ns / self.lag_ns)
        self._reference_radps = reference_radps
        return self._expected_radps
