"""Bootstrap particle filter (SIR) for a unicycle that is detected at irregular times.

    every step   x + dt v cos theta + noise,  y + dt v sin theta + noise,  theta + dt omega + noise      variance Q each
    detection    weights exp(-|z - p|^2 / 2 R), the weighted mean is the estimate, then systematic resampling

Unlike in `UnscentedKalman`, process noise is added at every step, with or without a detection.
Source: N. J. Gordon, D. J. Salmond, A. F. M. Smith, "Novel approach to nonlinear/non-Gaussian Bayesian state
estimation", 1993; systematic resampling: G. Kitagawa, 1996. Tuning: that of NUMBERS.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from agents.estimation import Inputs, Order


class ParticleFilter:
    def __init__(self, mean: tuple[float, float, float], variances: tuple[float, float, float],
                 rng: np.random.Generator, t_ns: int = 0, inputs: Inputs = Inputs(0.0, 0.0), *, particles: int = 1000,
                 step_ns: int = 70_000_000, process_m2: float = 0.01, measured_m2: float = 0.01) -> None:
        """Draw particles with `mean` (x, y, theta) [m, m, rad] and `variances` at t_ns; add noise every step_ns."""
        if particles < 2 or step_ns < 1:
            raise ValueError(f"particles={particles}, step_ns={step_ns}: expected at least 2 and 1")
        if not (process_m2 >= 0 and measured_m2 > 0 and min(variances) >= 0):
            raise ValueError(f"process_m2={process_m2}, measured_m2={measured_m2}, variances={variances}: expected "
                             f"variances of 0 or more, of the measurement more than 0")
        self._rng = rng
        self._state = np.array(mean)[:, None] + np.sqrt(variances)[:, None] * rng.standard_normal((3, particles))
        self._t_ns = t_ns
        self._then, self._then_ns = self._state, t_ns       # the particles at the newest detection
        self._inputs = inputs
        self._step_ns = step_ns
        self._sigma = sqrt(process_m2)
        self._precision = -0.5 / measured_m2
        self._places = np.arange(particles) / particles
        self._corrected = mean[0], mean[1]
        self._order = Order()

    @property
    def particles(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Rows x, y [m] and theta [rad], shape (3, particles), at the last `expect` or `correct`."""
        return self._state

    def expect(self, t_ns: int) -> tuple[float, float]:
        """Advance the particles to t_ns and return their mean, at a detection's time the weighted mean.

        Raises ValueError for a t_ns before the last one."""
        self._order.check_question(t_ns, self._t_ns)
        if t_ns == self._order.last_ns:
            return self._corrected
        self._advance(t_ns)
        x, y = self._state[:2].mean(axis=1)
        return float(x), float(y)

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs | None = None) -> bool:
        if not self._order.accepts(t_ns, x_m, y_m) or t_ns < self._then_ns:
            return False
        if t_ns < self._t_ns:                   # `expect` has advanced the particles past the detection
            self._state, self._t_ns = self._then, self._then_ns
        self._advance(t_ns)
        state = self._state
        dx, dy = state[0] - x_m, state[1] - y_m
        dx *= dx
        dy *= dy
        dx += dy
        weights = np.exp((dx - dx.min()) * self._precision)
        cumulated = np.cumsum(weights)
        self._corrected = float(state[0] @ weights / cumulated[-1]), float(state[1] @ weights / cumulated[-1])
        at = np.searchsorted(cumulated, (self._places + self._rng.random() / self._places.size) * cumulated[-1])
        self._state = state.take(at, axis=1, mode="clip")
        self._then, self._then_ns = self._state, t_ns
        self._order.last_ns = t_ns
        if inputs is not None:
            self._inputs = inputs
        return True

    def _advance(self, t_ns: int) -> None:
        while self._t_ns < t_ns:
            dt_ns = min(self._step_ns, t_ns - self._t_ns)
            theta = self._state[2]
            way = dt_ns * 1e-9 * self._inputs.v_mps
            moved = self._rng.standard_normal(self._state.shape)
            moved *= self._sigma * sqrt(dt_ns / self._step_ns)
            moved += self._state
            moved[0] += way * np.cos(theta)
            moved[1] += way * np.sin(theta)
            moved[2] += dt_ns * 1e-9 * self._inputs.omega_radps
            self._state = moved
            self._t_ns += dt_ns
