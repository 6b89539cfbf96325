"""The reachable set of the tracking error until the next measurement: C_i of section 4.5, steps 5, 6, as M1, M2, M3.

R1 drives the held command (v1, omega1) exactly, so in its frame a point at rest moves on an arc:

    c(t) = Rot(-omega1 t) (x1, x2) - v1 (sin(omega1 t), cos(omega1 t) - 1) / omega1

The error starts within `noise` of the measurement in each component, and R2 drives any inputs within `limits` (|v_R2|,
|omega_R2|), however they change. The bounds M_k >= |x_k(t)| for all t in [0, tau] are sums of the sharp bounds of three
parts: arc, rotated noise, and path of R2, whose direction relative to R1 stays in an interval.

Not modelled: a plant that does not follow the command (slip, a stopped drive); the bounds do not hold for it.
"""

from __future__ import annotations

from collections.abc import Callable
from math import floor, pi, sqrt

from agents.tracking.controller import Command, Inputs, State
from firmware_sim.shared_functions import cosine, sine_cosine

Extents = tuple[float, float, float]        # M1 [m], M2 [m], M3 [rad]

HALF_PI = pi / 2
QUARTER_PI = pi / 4
SQRT_2 = sqrt(2)


def extents_until(x: State, command: Command, limits: Inputs, noise: float) -> Callable[[float], Extents]:
    """Return tau [s] -> (M1, M2, M3), nondecreasing in tau; `limits` are the largest |v_R2| and |omega_R2|.

    Each part is sharp over [0, tau], but the parts need not be largest at the same time: M1 and M2 exceed the reachable
    values by at most the path of R2 plus the noise that the rotation adds.
    """
    y1, y2, y3 = x
    v1, omega1 = command
    v2, omega2 = limits
    slide = omega1 * y2 - v1                # c1'(0); c2'(0) = -omega1 y1
    away = omega1 * y1
    circle = sqrt(away * away + slide * slide)      # speed on the arc: |omega1| times its radius
    left, right = omega2 - omega1, omega2 + omega1
    high3, low3 = y3 + noise, y3 - noise
    abs_y1, abs_y2 = abs(y1), abs(y2)

    def until(tau_s: float) -> Extents:
        angle = omega1 * tau_s
        turned = abs(angle)
        if turned < HALF_PI:
            s, c = sine_cosine(angle)
            spread = noise * (c + abs(s)) if turned < QUARTER_PI else noise * SQRT_2
            if turned > 1e-6:
                along, across = s / omega1, s * s / ((1 + c) * omega1)
            else:
                along, across = tau_s, tau_s * angle / 2        # relative error below 1e-12
            c1 = c * y1 + s * y2 - v1 * along
            c2 = c * y2 - s * y1 + v1 * across
            m1, m2 = abs(c1), abs(c2)
            if m1 < abs_y1:
                m1 = abs_y1
            if m2 < abs_y2:
                m2 = abs_y2
            if slide * (omega1 * c2 - v1) < 0:                  # c1 has its extreme within tau, at the arc's radius
                m1 = circle / abs(omega1)
            elif y1 * c1 < 0 and omega1:                        # c2 has its extreme within tau
                round_it = circle if slide > 0 else -circle         # there c2 = (v1 + round_it) / omega1
                if v1 * round_it >= 0:
                    m2 = max(m2, abs((v1 + round_it) / omega1))
                else:                                               # the same without cancellation, for large circles
                    m2 = max(m2, abs((2 * v1 * y2 - omega1 * (y1 * y1 + y2 * y2)) / (v1 - round_it)))
        else:
            m1 = circle / abs(omega1)
            m2 = m1 + abs(v1 / omega1)
            spread = noise * SQRT_2
        way = v2 * tau_s
        half = noise + omega2 * tau_s + turned / 2
        middle = y3 - angle / 2
        m1 += spread + way * _largest_sine(middle + HALF_PI, half)
        m2 += spread + way * _largest_sine(middle, half)
        high = high3 + left * tau_s if left > 0 else high3
        low = low3 - right * tau_s if right > 0 else low3
        return m1, m2, high if high > -low else -low

    return until


def _largest_sine(middle: float, half: float) -> float:
    """Return the largest |sin| on [middle - half, middle + half]."""
    beyond = middle - floor(middle / pi) * pi                   # in [0, pi)
    away = abs(beyond - HALF_PI)                                # from the nearest angle at which |sin| is 1
    return 1.0 if away <= half else cosine(away - half)
