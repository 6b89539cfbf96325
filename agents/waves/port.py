"""A wave port: the end of a delayed line at a robot, with a damper K between the robot's output y and the line.

    F = K (y - e)                               force on the line; the robot feels -F; e is the line's own output
    v = (F + b e) / sqrt(2 b)                   wave that goes out
    w = (b e - F) / sqrt(2 b)                   wave that comes in                     F e = (v^2 - w^2) / 2

Given y and w, with kappa = K b / (b + K), alpha = K sqrt(2 b) / (b + K), rho = (b - K) / (b + K):

    -F = alpha w - kappa y                      v = alpha y + rho w

So the line takes the power (v^2 - w^2) / 2 at each end. A line that gives out no more wave energy than it was given is
passive, whatever its delay, and so is the whole of passive robots and such lines. With b = K nothing is reflected
(rho = 0), and a port is u = K/2 (y of the other end, delayed, - y).

Sampled, a robot sends once a period tau the mean (1/tau) int v over the time since it sent last. Its energy tau v_k^2
is at most int v^2 (Cauchy and Schwarz), so a receiver that uses v_k for at most tau gets no more than was sent. A wave
that does not arrive is 0.

Differs from Remark 7 of the dissertation, which puts the transformation on Sigma_n and Sigma_e: these are no two ends
of a line, and holding a sample of a wave can give more energy than was sent.
Source: Anderson and Spong 1989, Niemeyer and Slotine 1991; packets: Stramigioli et al. 2005.
Not modelled: springs between the ports (positions of robots whose speeds agree may differ).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf, sqrt


@dataclass(frozen=True)
class WavePort:
    damping: float          # K > 0
    impedance: float        # b > 0, the same at both ends of a line

    def __post_init__(self) -> None:
        for name in ("damping", "impedance"):
            if not 0 < getattr(self, name) < inf:
                raise ValueError(f"{name}={getattr(self, name)}: expected a positive number")

    @cached_property
    def own_damping(self) -> float:
        """kappa: the damper to ground that the port is to its robot when no wave comes in."""
        return self.impedance * self.damping / (self.impedance + self.damping)

    @cached_property
    def gain(self) -> float:
        """alpha, from the incoming wave to the force on the robot, and from the output to the outgoing wave."""
        return self.damping * sqrt(2 * self.impedance) / (self.impedance + self.damping)

    @cached_property
    def reflection(self) -> float:
        """rho, from the incoming wave to the outgoing one; between -1 and 1."""
        return (self.impedance - self.damping) / (self.impedance + self.damping)

    @cached_property
    def wave_at_rest(self) -> float:
        """Return the wave, out and in, of a port without force whose robot has the output 1."""
        return sqrt(self.impedance / 2)
