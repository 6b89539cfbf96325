"""The control loops of a flight: estimate, ramps, position, attitude, mixer. `flight_controller` gives the targets.

    every period            attitude and rates  -->  torques  -->  motor speeds
    every navigation        acceleration  -->  estimate  -->  ramps  -->  position control  -->  attitude and thrust

Without a valid position `descend` stops the vehicle and lets it sink by dead reckoning, with less and less lift once it
should have reached the ground.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from math import tan

from firmware_sim.autopilot.airframe import GRAVITY, Airframe
from firmware_sim.autopilot.attitude_control import AttitudeControl
from firmware_sim.autopilot.frames import down_axis, to_world, wrapped, yaw_of
from firmware_sim.autopilot.mixer import Mixer, Motors
from firmware_sim.autopilot.position_control import PositionControl
from firmware_sim.autopilot.position_estimator import PositionEstimator
from firmware_sim.autopilot.ramp import Ramp
from firmware_sim.autopilot.vehicle import AttitudeTarget, Parameters, PositionTarget, Quaternion, Vector

LAG_S = 0.015           # time constant of a motor that the mixer compensates
LEASH_M = 1.0           # largest distance of the reference from the estimated position
NEAR_GROUND_M = 0.05    # a target below this height is the ground
LIFT_LEAST = 0.5        # share of the hovering thrust at the end of a descent by dead reckoning
LIFT_FALLS = 0.2        # decrease of that share per second once the ground should be reached
NO_RATES: Vector = (0.0, 0.0, 0.0)
LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)


class Drive(Enum):
    """Operation of the motors."""

    OFF = "off"
    IDLE = "idle"
    ATTITUDE = "attitude"
    RATES = "rates"


class FlightLoops:
    def __init__(self, airframe: Airframe, period_s: float, navigation_s: float) -> None:
        self.airframe = airframe
        self.estimate = PositionEstimator()
        self.horizontal, self.vertical = Ramp(2), Ramp(1)
        self.yaw_ref = 0.0
        self.ground_down = 0.0                  # [m] NED z of the ground, as known
        self.drive = Drive.OFF
        self.quaternion, self.rates, self.force = LEVEL, NO_RATES, NO_RATES
        self.thrust_n = 0.0
        self.target, self.rates_target = LEVEL, NO_RATES
        self._dt = navigation_s
        self._drag = tuple(each / airframe.mass_kg for each in airframe.drag_nspm)         # [1/s]
        self._weight_n = airframe.mass_kg * GRAVITY
        self._attitude, self._position = AttitudeControl(airframe), PositionControl(airframe.mass_kg)
        self._mixer = Mixer(airframe, period_s, LAG_S)
        self._get: Callable[[str], float] = lambda _name: 0.0
        self._below_s = 0.0

    def tune(self, parameters: Parameters) -> None:
        """Apply changed parameters."""
        self._get = get = parameters.get
        attitude, position = self._attitude, self._position
        attitude.k_angle, attitude.k_rate = get("ATT_KP"), get("ATT_KD")
        attitude.k_yaw, attitude.k_yaw_rate = get("YAW_KP"), get("YAW_KD")
        position.kp, position.kd, position.ki = get("POS_KP"), get("POS_KD"), get("POS_KI")
        position.kp_z, position.kd_z, position.ki_z = get("ALT_KP"), get("ALT_KD"), get("ALT_KI")
        position.tan_tilt = tan(get("TILT_MAX"))
        self.estimate.bandwidth = get("EST_BW")

    # --- every period

    def motors(self) -> Motors:
        """Return the motor commands for the last sensor values."""
        drive = self.drive
        if drive is Drive.ATTITUDE:
            x, y, z = self._attitude.torque(self.quaternion, self.rates, self.target, self.rates_target)
            return self._mixer.mix(self.thrust_n, x, y, z)
        if drive is Drive.OFF:
            return self._mixer.off()
        if drive is Drive.IDLE:
            return self._mixer.idle()
        x, y, z = self._attitude.rate_torque(self.rates, self.rates_target)
        return self._mixer.mix(self.thrust_n, x, y, z)

    # --- every navigation: `predict`, then one of the others

    def predict(self, now_ns: int) -> None:
        x, y, z = to_world(self.quaternion, self.force)
        self.estimate.predict(now_ns, (x, y, z + GRAVITY), self._dt)

    @property
    def hover_n(self) -> float:
        """The hovering thrust [N], corrected by the integral of the height error."""
        return self._weight_n - self.airframe.mass_kg * self._position.lift_spared

    @property
    def height_m(self) -> float:
        return self.ground_down - self.estimate.position[2]

    def stop(self) -> None:
        self.drive, self.thrust_n = Drive.OFF, 0.0

    def idle(self) -> None:
        """Let the motors idle on the ground."""
        self.drive, self.thrust_n = Drive.IDLE, 0.0

    def begin(self, fresh: bool) -> None:
        """Start the ramps at the estimated position; `fresh` also resets the integral."""
        (north, east, down), (vn, ve, vd) = self.estimate.position, self.estimate.velocity
        self.horizontal.restart((north, east), (vn, ve))
        self.vertical.restart((down,), (vd,))
        self.yaw_ref = yaw_of(self.quaternion)
        self._below_s = 0.0
        if fresh:
            self._position.restart()

    def follow(self, goal: PositionTarget) -> None:
        """Make one step along the ramps towards `goal`."""
        get, dt, flat, upright = self._get, self._dt, self.horizontal, self.vertical
        north, east, down = goal.position_ned_m
        vn, ve, vd = goal.velocity_ned_mps
        if down is not None and down > self.ground_down - NEAR_GROUND_M:
            down, vd = None, get("LAND_SPEED")
        flat.step((north, east), (vn, ve), get("VEL_MAX"), get("ACC_MAX"), dt)
        upright.step((down,), (vd,), get("CLIMB_MAX"), get("ACC_Z_MAX"), dt)
        p, v = self.estimate.position, self.estimate.velocity
        flat.leash(p[:2], LEASH_M)
        upright.leash(p[2:], LEASH_M)
        yaw_rate = self._turn(goal)
        rx, ry, (rz,) = *flat.position, upright.position
        wx, wy, (wz,) = *flat.velocity, upright.velocity
        ax, ay, (az,) = *flat.acceleration, upright.acceleration
        drag, drag_z = self._drag
        self.target, self.thrust_n = self._position.step(
            (rx - p[0], ry - p[1], rz - p[2]), (wx - v[0], wy - v[1], wz - v[2]),
            (ax + drag * wx, ay + drag * wy, az + drag_z * wz), self.yaw_ref, self.quaternion, dt)
        self.rates_target = _body_yaw(self.quaternion, yaw_rate)
        self.drive = Drive.ATTITUDE

    def aim(self, target: AttitudeTarget) -> None:
        """Follow an attitude or body rates."""
        self.thrust_n = target.thrust * self.airframe.full_thrust_n
        self.rates_target = target.rates_radps or NO_RATES
        if target.quaternion_wxyz is None:
            self.drive = Drive.RATES
        else:
            self.drive, self.target = Drive.ATTITUDE, target.quaternion_wxyz

    def descend(self) -> None:
        """Stop and sink by dead reckoning; the integral goes on compensating the wind."""
        speed, dt = self._get("LAND_SPEED"), self._dt
        vn, ve, vd = self.estimate.velocity
        self.target, thrust_n = self._position.step((0.0, 0.0, 0.0), (-vn, -ve, speed - vd), (0.0, 0.0, 0.0),
                                                    self.yaw_ref, self.quaternion, None)
        if self.height_m < -LEASH_M * speed:
            self._below_s += dt
        most = self.hover_n * max(LIFT_LEAST, 1 - LIFT_FALLS * self._below_s) if self._below_s else thrust_n
        self.thrust_n = min(thrust_n, most)
        self.rates_target = NO_RATES
        self.drive = Drive.ATTITUDE

    def _turn(self, goal: PositionTarget) -> float:
        """Make one step of the heading's ramp; return the yaw rate of its reference."""
        most = self._get("YAW_RATE_MAX")
        rate = goal.yaw_rate_radps or 0.0
        if goal.yaw_rad is not None:
            rate += wrapped(goal.yaw_rad - self.yaw_ref) / self._dt
        rate = max(-most, min(most, rate))
        self.yaw_ref = wrapped(self.yaw_ref + rate * self._dt)
        return rate


def _body_yaw(q: Quaternion, rate: float) -> Vector:
    """Return a rotation at `rate` about the world's z axis as body rates."""
    if not rate:
        return NO_RATES
    w, x, y, z = q
    return rate * 2 * (x * z - w * y), rate * 2 * (y * z + w * x), rate * down_axis(q)[2]
