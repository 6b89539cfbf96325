"""The firmware's model of its vehicle: numbers from the scenario, from which the plant's may differ.

    F = k_thrust w^2 a rotor        full = 4 k_thrust motor_max^2        hover = weight / full

Defaults: the Hummingbird of the GRASP testbed (Michael et al. 2010); docs/models/quadrotor.md has each number's source.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite
from typing import Final

GRAVITY = 9.81      # [m/s2]


@dataclass(frozen=True)
class Airframe:
    mass_kg: float = 0.5
    inertia_kgm2: tuple[float, float, float] = (2.32e-3, 2.32e-3, 4.0e-3)
    arm_m: float = 0.175
    k_thrust: float = 5.571652e-6           # [N s2]
    k_moment: float = 1.367836e-7           # [N m s2]
    tau_motor_s: float = 0.05
    motor_min_radps: float = 125.66371
    motor_max_radps: float = 816.81409
    drag_nspm: tuple[float, float] = (0.15, 0.25)       # force per speed, horizontal and vertical

    def __post_init__(self) -> None:
        object.__setattr__(self, "inertia_kgm2", tuple(self.inertia_kgm2))
        if len(self.inertia_kgm2) != 3:
            raise ValueError(f"inertia_kgm2={list(self.inertia_kgm2)}: expected three moments of inertia")
        object.__setattr__(self, "drag_nspm", tuple(self.drag_nspm))
        if len(self.drag_nspm) != 2 or not all(isfinite(each) and each >= 0 for each in self.drag_nspm):
            raise ValueError(f"drag_nspm={list(self.drag_nspm)}: expected horizontal and vertical, 0 or more")
        for each in fields(self):
            value = getattr(self, each.name)
            for number in value if isinstance(value, tuple) else (value,):
                if each.name != "drag_nspm" and not (isfinite(number) and number > 0):
                    raise ValueError(f"{each.name}={number}: expected more than 0")
        if self.motor_min_radps >= self.motor_max_radps:
            raise ValueError(f"motor_min_radps={self.motor_min_radps}: expected less than motor_max_radps "
                             f"({self.motor_max_radps})")
        if self.full_thrust_n <= self.mass_kg * GRAVITY:
            raise ValueError(f"mass_kg={self.mass_kg}: its rotors lift {self.full_thrust_n:g} N, less than its weight")

    @property
    def full_thrust_n(self) -> float:
        return 4 * self.k_thrust * self.motor_max_radps**2


HUMMINGBIRD: Final = Airframe()
