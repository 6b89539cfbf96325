"""Position and velocity from accelerations, corrected by late frames of motion capture.

    predict    p += v dt + a dt^2 / 2      v += a dt              a measured, in the world
    correct    r = z - p(t_z)              p(t), v(t) += (g + h (t - t_z)) r, h r     for all remembered t >= t_z
               g = 1 - theta^2             h = (1 - theta)^2 / T              theta = exp(-bandwidth T)

T is the time between two frames. Between frames the estimate is dead reckoning. A frame is compared with the estimate
at its exposure, not at its arrival.

Source: fading-memory g-h filter of first degree, Brookner 1998, Tracking and Kalman Filtering Made Easy;
the delayed comparison as in Lynen et al. 2013.
Not modelled: biases of the accelerometer, frames of another body.

Invariants:
- frames are accepted in the order of their exposure; one older than the last, or from the future, changes nothing;
- the last `MEMORY` predictions are kept; an older frame is refused.
"""

from __future__ import annotations

from collections import deque
from math import exp, isfinite

from firmware_sim.autopilot.vehicle import Vector

MEMORY = 64                     # number of predictions kept
LONGEST_NS = 500_000_000        # time without frames after which a frame replaces the estimate
JUMP_NS = 20_000_000
LONG_AGO_NS = -(10**18)


class PositionEstimator:
    def __init__(self) -> None:
        self.bandwidth = 10.0                   # [1/s]
        self.position: Vector = (0.0, 0.0, 0.0)
        self.velocity: Vector = (0.0, 0.0, 0.0)
        self.now_ns = LONG_AGO_NS
        self.exposed_ns = LONG_AGO_NS              # exposure of the last frame accepted
        self._past: deque[tuple[int, Vector, Vector]] = deque(maxlen=MEMORY)

    def age_ns(self, now_ns: int) -> int:
        """Return the time since the exposure of the last frame accepted."""
        return max(0, now_ns - self.exposed_ns)

    def predict(self, now_ns: int, acceleration: Vector, dt_s: float) -> None:
        """Predict over `dt_s`; a clock that differs from that by more than `JUMP_NS` was stepped."""
        jump_ns = now_ns - self.now_ns - round(dt_s * 1e9)
        if abs(jump_ns) > JUMP_NS and self.now_ns != LONG_AGO_NS:
            self.exposed_ns += jump_ns
            self._past = deque(((then_ns + jump_ns, p, v) for then_ns, p, v in self._past), MEMORY)
        (px, py, pz), (vx, vy, vz), (ax, ay, az) = self.position, self.velocity, acceleration
        half = dt_s / 2
        nx, ny, nz = vx + ax * dt_s, vy + ay * dt_s, vz + az * dt_s
        self.position = px + (vx + nx) * half, py + (vy + ny) * half, pz + (vz + nz) * half
        self.velocity = nx, ny, nz
        self.now_ns = now_ns
        self._past.append((now_ns, self.position, self.velocity))

    def stand(self) -> None:
        """Set the velocity to zero: the vehicle stands on the ground."""
        self.velocity = (0.0, 0.0, 0.0)

    def correct(self, exposed_ns: int, measured: Vector, now_ns: int) -> bool:
        """Correct the estimate by a frame; False if the frame was refused."""
        if not all(map(isfinite, measured)) or not self.exposed_ns < exposed_ns <= now_ns:
            return False
        gap_ns = exposed_ns - self.exposed_ns
        past = self._past
        if gap_ns > LONGEST_NS or not past:
            self.exposed_ns = exposed_ns
            vx, vy, vz = self.velocity = (0.0, 0.0, 0.0) if gap_ns > 10 * LONGEST_NS else self.velocity
            age_s = max(0, self.now_ns - exposed_ns) / 1e9
            self.position = measured[0] + vx * age_s, measured[1] + vy * age_s, measured[2] + vz * age_s
            past.clear()
            past.append((exposed_ns, measured, self.velocity))
            return True
        if exposed_ns < past[0][0]:
            return False
        self.exposed_ns = exposed_ns
        at = len(past) - 1
        while at and past[at][0] > exposed_ns:
            at -= 1
        then_ns, (px, py, pz), (vx, vy, vz) = past[at]
        since_s = (exposed_ns - then_ns) / 1e9
        r = (measured[0] - px - vx * since_s, measured[1] - py - vy * since_s, measured[2] - pz - vz * since_s)
        theta = exp(-self.bandwidth * gap_ns / 1e9)
        g, h = 1 - theta * theta, (1 - theta) ** 2 / (gap_ns / 1e9)
        for k in range(at + 1, len(past)):
            then_ns, p, v = past[k]
            past[k] = (then_ns, *_moved(p, v, r, g + h * (then_ns - exposed_ns) / 1e9, h))
        by = g + h * (self.now_ns - exposed_ns) / 1e9
        self.position, self.velocity = _moved(self.position, self.velocity, r, by, h)
        return True


def _moved(p: Vector, v: Vector, r: Vector, by: float, slope: float) -> tuple[Vector, Vector]:
    x, y, z = r
    return (p[0] + by * x, p[1] + by * y, p[2] + by * z), (v[0] + slope * x, v[1] + slope * y, v[2] + slope * z)
