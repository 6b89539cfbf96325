"""Trajectory tracking of a velocity-controlled unicycle (4.1)-(4.4), after Samson and Ait-Abderrahim 1991 ([98]).

    x = Rot(-theta_R1) (R2 - R1)                                   tracking error in the frame of R1, (4.2)
    v_R1     = v_R2 cos x3 + k1 x1                                                                  (4.4)
    omega_R1 = omega_R2 + k2 v_R2 (sin x3 / x3) x2 + k3 x3

Not modelled: wheels, slip, limits of the command; they belong to the drive and the plant. (4.4) is not periodic in
x3: the caller must unwrap the heading error or bring it to (-pi, pi].
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

from firmware_sim.shared_functions import sine_cosine

State = tuple[float, float, float]      # tracking error x: ahead [m], left [m], heading [rad]


class Inputs(NamedTuple):
    """omega_p, the inputs of the reference robot R2."""

    v_mps: float
    omega_rad_s: float


class Command(NamedTuple):
    """u, the command to the robot R1."""

    v_mps: float
    omega_rad_s: float


class Pose(NamedTuple):
    x_m: float
    y_m: float
    theta_rad: float


@dataclass(frozen=True)
class TrackingController:
    """The control law (4.4); the defaults are the gains of section 4.6."""

    k1_per_s: float = 1.5
    k2_per_m2: float = 1.2
    k3_per_s: float = 1.1

    def __post_init__(self) -> None:
        for name in ("k1_per_s", "k2_per_m2", "k3_per_s"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"{name}={value}: the gains of (4.4) are positive; the loop diverges otherwise")

    def command(self, x: State, inputs: Inputs) -> Command:
        """Return u for a tracking error, measured or true, and the inputs of R2 at the same time."""
        x1, x2, x3 = x
        v_mps, omega_rad_s = inputs
        sine, cosine = sine_cosine(x3)
        sinc = sine / x3 if x3 else 1.0
        return Command(v_mps * cosine + self.k1_per_s * x1,
                       omega_rad_s + self.k2_per_m2 * v_mps * sinc * x2 + self.k3_per_s * x3)


def placed(own: Pose, x: State) -> Pose:
    """Return the reference's pose for which `own` has the tracking error x: the inverse of `tracking_error`."""
    s, c = sine_cosine(own.theta_rad)
    ahead_m, left_m, turned_rad = x
    return Pose(own.x_m + c * ahead_m - s * left_m, own.y_m + s * ahead_m + c * left_m, own.theta_rad + turned_rad)


def tracking_error(own: Pose, reference: Pose) -> State:
    """Return the tracking error x of (4.2), in the frame of `own`; the heading error is not wrapped."""
    s, c = sine_cosine(own.theta_rad)
    east_m, north_m = reference.x_m - own.x_m, reference.y_m - own.y_m
    return c * east_m + s * north_m, c * north_m - s * east_m, reference.theta_rad - own.theta_rad
