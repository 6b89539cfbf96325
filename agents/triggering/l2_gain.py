"""A lower estimate of the L2-gain of a nonlinear system, for inputs of one norm over one finite horizon.

    x' = f(x, w),  x(0) = 0,  y = h(x, w):   maximize ||y[0, T]||_2 / ||w[0, T]||_2  over  ||w[0, T]||_2 = amplitude

by power iteration with adjoints (for L2-gains as optimal control Imae 1996, [101]; the alternating iteration Tierno,
Murray, Doyle and Gregory 1997): simulate w forwards, integrate the adjoint system backwards, take as the next input the
gradient of ||y||^2 scaled to the amplitude. w is constant on steps; RK4 integrates x and ||y||^2, and the adjoint is
that of RK4, so the gradient is that of the computed value.

Differs from the dissertation, which calls the result the gain. It is a lower estimate of the gain *of that amplitude
and horizon*: the iteration finds local maxima, and the gain may grow without limit with amplitude or horizon.
Not modelled: L_p for other p; switching inputs between steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class NominalSystem(Protocol):
    """The system x' = f(x, w), y = h(x, w); arrays have shape (components, starts), for several inputs at once."""

    @property
    def states(self) -> int: ...

    @property
    def inputs(self) -> int: ...

    def rate(self, x: Floats, w: Floats) -> Floats:
        """Return f(x, w)."""

    def output(self, x: Floats, w: Floats) -> Floats:
        """Return h(x, w)."""

    def rate_adjoint(self, x: Floats, w: Floats, p: Floats) -> tuple[Floats, Floats]:
        """Return (df/dx)' p and (df/dw)' p."""

    def output_adjoint(self, x: Floats, w: Floats, q: Floats) -> tuple[Floats, Floats]:
        """Return (dh/dx)' q and (dh/dw)' q; where h is not differentiable, with any one-sided derivative."""


@dataclass(frozen=True, eq=False)
class GainEstimate:
    """The largest gain found: `worst_input` has it, so the true gain is not smaller."""

    lower_estimate: float
    amplitude: float            # ||w[0, horizon_s]||_2
    horizon_s: float
    iterations: int
    settled: bool               # True: the last iteration changed the best gain by no more than the tolerance
    worst_input: Floats         # (steps, inputs), constant on each step


def estimate_gain(system: NominalSystem, amplitude: float, horizon_s: float, *, steps: int = 200, starts: int = 8,
                  iterations: int = 60, tolerance: float = 1e-4, seed: int = 0) -> GainEstimate:
    """Improve `starts` random inputs until the best gain settles, and return the best.

    Raises RuntimeError if every input drives the state to infinity, ValueError for arguments out of range."""
    for name, value in (("amplitude", amplitude), ("horizon_s", horizon_s)):
        if not (isfinite(value) and value > 0):
            raise ValueError(f"{name}={value}: expected a positive number")
    for name, count in (("steps", steps), ("starts", starts), ("iterations", iterations)):
        if count < 1:
            raise ValueError(f"{name}={count}: expected 1 or more")
    h_s = horizon_s / steps
    w = _scaled(np.random.default_rng(seed).normal(size=(steps, system.inputs, starts)), amplitude, h_s)
    best, best_input, before, settled, done = -1.0, w[:, :, 0], 0.0, False, 0
    with np.errstate(over="ignore", invalid="ignore"):
        while done < iterations and not settled:
            done += 1
            stages, energy = _forwards(system, w, h_s)
            gains = np.where(np.isfinite(energy), np.sqrt(energy), -1.0) / amplitude
            k = int(np.argmax(gains))
            if gains[k] < 0:
                raise RuntimeError(f"every input of amplitude {amplitude:g} drives the state to infinity: "
                                   f"choose a smaller amplitude or more steps than {steps}")
            if gains[k] > best:
                best, best_input = float(gains[k]), w[:, :, k].copy()
            settled = bool(abs(gains[k] - before) <= tolerance * gains[k])
            before = float(gains[k])
            gradient = _backwards(system, w, stages, h_s)
            gradient[:, :, gains < 0] = 0.0
            w = _scaled(gradient, amplitude, h_s)
    return GainEstimate(best, amplitude, horizon_s, done, settled, best_input)


def _scaled(w: Floats, amplitude: float, h_s: float) -> Floats:
    norms = np.sqrt((w * w).sum(axis=(0, 1)) * h_s)
    return w * (amplitude / np.where(norms > 0, norms, 1.0))


Stages = list[tuple[Floats, Floats, Floats, Floats]]


def _forwards(system: NominalSystem, w: Floats, h_s: float) -> tuple[Stages, Floats]:
    """Return the four stage states of each step, and ||y||^2 of each start."""
    x = np.zeros((system.states, w.shape[2]))
    energy = np.zeros(w.shape[2])
    stages: Stages = []
    for now in w:
        k1 = system.rate(x, now)
        x2 = x + h_s / 2 * k1
        k2 = system.rate(x2, now)
        x3 = x + h_s / 2 * k2
        k3 = system.rate(x3, now)
        x4 = x + h_s * k3
        k4 = system.rate(x4, now)
        stages.append((x, x2, x3, x4))
        for stage, weight in zip(stages[-1], (h_s / 6, h_s / 3, h_s / 3, h_s / 6), strict=True):
            y = system.output(stage, now)
            energy += weight * (y * y).sum(axis=0)
        x = x + h_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return stages, energy


def _backwards(system: NominalSystem, w: Floats, stages: Stages, h_s: float) -> Floats:
    """Return the gradient of ||y||^2 with respect to w."""
    gradient = np.empty_like(w)
    adjoint = np.zeros((system.states, w.shape[2]))
    for n in range(len(w) - 1, -1, -1):
        now, total, of_input = w[n], adjoint, np.zeros_like(w[n])
        later = np.zeros_like(adjoint)                  # adjoint of the stage after this one
        for stage, weight, reach in zip(reversed(stages[n]), (h_s / 6, h_s / 3, h_s / 3, h_s / 6),
                                        (0.0, h_s, h_s / 2, h_s / 2), strict=True):
            of_state, direct = system.rate_adjoint(stage, now, weight * adjoint + reach * later)
            by_output, fed_through = system.output_adjoint(stage, now, 2 * weight * system.output(stage, now))
            later = of_state + by_output
            total = total + later
            of_input = of_input + direct + fed_through
        adjoint = total
        gradient[n] = of_input
    return gradient
