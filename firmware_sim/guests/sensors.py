"""The sensors that PX4 is told to have: accelerometer, gyroscope, magnetometer, barometer, GPS.

    reading = truth + N(0, sigma), drawn anew for every axis and reading
    pressure = 1013.25 hPa (1 - 0.0065 h / 288.15)^5.25588        temperature = 15 - 0.0065 h      h: altitude [m]

Noise is needed: PX4 takes a sensor that repeats a value exactly for a broken one.
Source: ICAO, Manual of the Standard Atmosphere (Doc 7488): the pressure below 11 km. Not modelled: bias, scale, delay,
the variation of the magnetic field over the flight.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, degrees, hypot, isfinite
from random import Random

from firmware_sim.autopilot.frames import to_world
from firmware_sim.autopilot.vehicle import Quaternion, Vector
from firmware_sim.guests.body import Motion
from firmware_sim.mavlink.dialect import Message, message
from firmware_sim.mavlink.geodesy import Origin

ACCELEROMETER, GYROSCOPE, MAGNETOMETER, BAROMETER = 0x7, 0x38, 0x1C0, 0x1A00      # fields_updated, whole groups only
SEA_LEVEL_HPA, SEA_LEVEL_K, LAPSE_K_PER_M, EXPONENT = 1013.25, 288.15, 0.0065, 5.25588
ZERO_CELSIUS_K = 273.15
FIX_3D, SATELLITES = 3, 12
EPH_CM, EPV_CM = 80, 120


@dataclass(frozen=True)
class SensorSettings:
    accelerometer_sigma_mps2: float = 0.02
    gyroscope_sigma_radps: float = 0.002
    magnetometer_sigma_gauss: float = 0.002
    barometer_sigma_hpa: float = 0.005
    field_ned_gauss: tuple[float, float, float] = (0.215, 0.011, 0.429)      # the Earth's, at the default origin
    latitude_deg: float = Origin.latitude_deg
    longitude_deg: float = Origin.longitude_deg
    altitude_m: float = Origin.altitude_m

    def __post_init__(self) -> None:
        object.__setattr__(self, "field_ned_gauss", tuple(self.field_ned_gauss))
        for name in ("accelerometer_sigma_mps2", "gyroscope_sigma_radps", "magnetometer_sigma_gauss",
                     "barometer_sigma_hpa"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected a finite number, 0 or more")
        if len(self.field_ned_gauss) != 3 or not all(map(isfinite, self.field_ned_gauss)):
            raise ValueError(f"field_ned_gauss={list(self.field_ned_gauss)}: expected three finite numbers")
        _ = self.origin

    @property
    def origin(self) -> Origin:
        return Origin(self.latitude_deg, self.longitude_deg, self.altitude_m)


class Sensors:
    def __init__(self, settings: SensorSettings, rng: Random) -> None:
        self._settings, self._rng = settings, rng
        self._origin = settings.origin

    def inertial(self, motion: Motion, time_us: int) -> Message:
        """Return HIL_SENSOR with every group of fields, for the first instance of each sensor."""
        settings = self._settings
        ax, ay, az = self._noisy(motion.force_mps2, settings.accelerometer_sigma_mps2)
        gx, gy, gz = self._noisy(motion.rates_radps, settings.gyroscope_sigma_radps)
        mx, my, mz = self._noisy(to_body(motion.quaternion_wxyz, settings.field_ned_gauss),
                                 settings.magnetometer_sigma_gauss)
        height_m = self._altitude_m(motion)
        pressure_hpa = standard_pressure_hpa(height_m) + self._rng.gauss(0.0, settings.barometer_sigma_hpa)
        return message("HIL_SENSOR", time_usec=time_us, xacc=ax, yacc=ay, zacc=az, xgyro=gx, ygyro=gy, zgyro=gz,
                       xmag=mx, ymag=my, zmag=mz, abs_pressure=pressure_hpa,
                       pressure_alt=pressure_altitude_m(pressure_hpa),
                       temperature=SEA_LEVEL_K - LAPSE_K_PER_M * height_m - ZERO_CELSIUS_K,
                       fields_updated=ACCELEROMETER | GYROSCOPE | MAGNETOMETER | BAROMETER)

    def gps(self, motion: Motion, time_us: int) -> Message:
        """Return HIL_GPS: the true place and velocity, in the message's whole units."""
        north, east, _ = motion.position_ned_m
        latitude_e7, longitude_e7 = self._origin.to_global(north, east)
        vn, ve, vd = (_centi(speed) for speed in motion.velocity_ned_mps)
        speed_mps = hypot(*motion.velocity_ned_mps[:2])
        course_cdeg = round(degrees(atan2(motion.velocity_ned_mps[1], motion.velocity_ned_mps[0])) * 100) % 36_000
        return message("HIL_GPS", time_usec=time_us, fix_type=FIX_3D, lat=latitude_e7, lon=longitude_e7,
                       alt=round(self._altitude_m(motion) * 1e3), eph=EPH_CM, epv=EPV_CM,
                       vel=min(round(speed_mps * 100), 0xFFFE), vn=vn, ve=ve, vd=vd, cog=course_cdeg,
                       satellites_visible=SATELLITES)

    def truth(self, motion: Motion, time_us: int) -> Message:
        """Return HIL_STATE_QUATERNION, from which PX4 logs the ground truth."""
        north, east, _ = motion.position_ned_m
        latitude_e7, longitude_e7 = self._origin.to_global(north, east)
        vx, vy, vz = (_centi(speed) for speed in motion.velocity_ned_mps)
        ax, ay, az = (_limited(each / 9.80665 * 1e3) for each in motion.force_mps2)
        roll, pitch, yaw = motion.rates_radps
        return message("HIL_STATE_QUATERNION", time_usec=time_us, attitude_quaternion=motion.quaternion_wxyz,
                       rollspeed=roll, pitchspeed=pitch, yawspeed=yaw, lat=latitude_e7, lon=longitude_e7,
                       alt=round(self._altitude_m(motion) * 1e3), vx=vx, vy=vy, vz=vz, xacc=ax, yacc=ay, zacc=az)

    def _altitude_m(self, motion: Motion) -> float:
        return self._origin.altitude_m - motion.position_ned_m[2]

    def _noisy(self, truth: Vector, sigma: float) -> Vector:
        x, y, z = truth
        gauss = self._rng.gauss
        return x + gauss(0.0, sigma), y + gauss(0.0, sigma), z + gauss(0.0, sigma)


def standard_pressure_hpa(altitude_m: float) -> float:
    return float(SEA_LEVEL_HPA * (1 - LAPSE_K_PER_M * altitude_m / SEA_LEVEL_K) ** EXPONENT)


def pressure_altitude_m(pressure_hpa: float) -> float:
    return float(SEA_LEVEL_K / LAPSE_K_PER_M * (1 - (max(pressure_hpa, 0.0) / SEA_LEVEL_HPA) ** (1 / EXPONENT)))


def to_body(q: Quaternion, v: Vector) -> Vector:
    """Return the world vector `v` in the body's frame."""
    w, x, y, z = q
    return to_world((w, -x, -y, -z), v)


def _centi(speed_mps: float) -> int:
    return _limited(speed_mps * 100)


def _limited(value: float) -> int:
    """Round to a 16-bit integer, at its limits if the value lies beyond."""
    return max(-32_767, min(32_767, round(value)))
