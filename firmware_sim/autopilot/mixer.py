"""Computes motor speeds from thrust and torques, for rotors on the body's axes: front, left, back, right.

    F_front, F_back = T/4 +- tau_y / 2 arm - tau_z / 4 c      c = k_moment / k_thrust
    F_left, F_right = T/4 +- tau_x / 2 arm + tau_z / 4 c      torques in FRD

If the motors cannot produce all of it, roll and pitch have priority, then the thrust, then yaw. The commands reduce the
time constant of the motors, first order with `tau`, to `lag_s`:

    u = w^ + tau / lag (w - w^)       w^: the modelled motor speed

Source: Faessler, Falanga, Scaramuzza 2017, Thrust mixing, saturation, and body-rate control (priorities, lag).
"""

from __future__ import annotations

from math import exp, sqrt

from firmware_sim.autopilot.airframe import Airframe

Motors = tuple[float, float, float, float]
OFF: Motors = (0.0, 0.0, 0.0, 0.0)


class Mixer:
    """Computes one command per call; calls are `period_s` apart."""

    def __init__(self, airframe: Airframe, period_s: float, lag_s: float) -> None:
        self._k_thrust = airframe.k_thrust
        self._low_n = airframe.k_thrust * airframe.motor_min_radps**2
        self._high_n = airframe.k_thrust * airframe.motor_max_radps**2
        self._most_n = (self._high_n - self._low_n) / 2
        self._per_roll = 1 / (2 * airframe.arm_m)
        self._per_yaw = airframe.k_thrust / (4 * airframe.k_moment)
        self._min, self._max = airframe.motor_min_radps, airframe.motor_max_radps
        self._haste = max(1.0, airframe.tau_motor_s / lag_s)
        self._follows = 1 - exp(-period_s / airframe.tau_motor_s)
        self._modelled = OFF

    def mix(self, thrust_n: float, roll_nm: float, pitch_nm: float, yaw_nm: float) -> Motors:
        roll, pitch, each = roll_nm * self._per_roll, pitch_nm * self._per_roll, thrust_n / 4
        low, high = self._low_n, self._high_n
        lever = max(abs(roll), abs(pitch))
        if lever > self._most_n:
            scale = self._most_n / lever
            roll, pitch, lever = roll * scale, pitch * scale, self._most_n
        if each < low + lever:
            each = low + lever
        elif each > high - lever:
            each = high - lever
        yaw = yaw_nm * self._per_yaw
        if yaw >= 0:
            yaw = min(yaw, each - abs(pitch) - low, high - each - abs(roll))
        else:
            yaw = max(yaw, low + abs(roll) - each, each + abs(pitch) - high)
        k = self._k_thrust
        one, two = each - yaw, each + yaw
        return self._compensated(sqrt(max(low, one + pitch) / k), sqrt(max(low, two + roll) / k),
                             sqrt(max(low, one - pitch) / k), sqrt(max(low, two - roll) / k))

    def idle(self) -> Motors:
        return self._compensated(self._min, self._min, self._min, self._min)

    def off(self) -> Motors:
        a, b, c, d = self._modelled
        keeps = 1 - self._follows
        self._modelled = a * keeps, b * keeps, c * keeps, d * keeps
        return OFF

    def _compensated(self, a: float, b: float, c: float, d: float) -> Motors:
        haste, follows, low, high = self._haste, self._follows, self._min, self._max
        p, q, r, s = self._modelled
        a = min(high, max(low, p + haste * (a - p)))
        b = min(high, max(low, q + haste * (b - q)))
        c = min(high, max(low, r + haste * (c - r)))
        d = min(high, max(low, s + haste * (d - s)))
        self._modelled = (p + follows * (a - p), q + follows * (b - q), r + follows * (c - r), s + follows * (d - s))
        return a, b, c, d
