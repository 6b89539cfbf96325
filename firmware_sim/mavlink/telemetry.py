"""Messages of the vehicle's estimated state: one function for each that can be streamed or requested.

The position, from motion capture, is sent as LOCAL_POSITION_NED and, by the flat map around the configured origin, as
GLOBAL_POSITION_INT and as a GPS with a fix, without which clients would not fly. Home is the place of the last arming.
Not modelled: a battery (its fields say "not measured"), an estimate of wind, raw sensors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from math import degrees, hypot, pi
from typing import Final

from firmware_sim.autopilot.frames import roll_pitch_yaw, yaw_of
from firmware_sim.autopilot.vehicle import Landed, Mode, Quaternion, Vector, Vehicle, VehicleState
from firmware_sim.mavlink.dialect import Message, layout_of, message
from firmware_sim.mavlink.enums import (
    AUTOPILOT_PX4,
    GPS_FIX_TYPE_3D_FIX,
    TYPE_QUADROTOR,
    Capability,
    LandedState,
    Sensor,
    SystemState,
)
from firmware_sim.mavlink.geodesy import Origin
from firmware_sim.mavlink.px4_modes import base_mode, custom_mode

MS_NS: Final = 1_000_000
LANDED: Final = {Landed.ON_GROUND: LandedState.ON_GROUND, Landed.TAKING_OFF: LandedState.TAKEOFF,
                 Landed.IN_AIR: LandedState.IN_AIR, Landed.LANDING: LandedState.LANDING}
BODY_SENSORS: Final = (Sensor.SENSOR_3D_GYRO | Sensor.SENSOR_3D_ACCEL | Sensor.SENSOR_3D_MAG
                       | Sensor.SENSOR_ABSOLUTE_PRESSURE | Sensor.SENSOR_ATTITUDE_STABILIZATION
                       | Sensor.SENSOR_MOTOR_OUTPUTS | Sensor.GEOFENCE | Sensor.PREARM_CHECK)
POSITION_SENSORS: Final = (Sensor.SENSOR_GPS | Sensor.SENSOR_YAW_POSITION | Sensor.SENSOR_Z_ALTITUDE_CONTROL
                           | Sensor.SENSOR_XY_POSITION_CONTROL | Sensor.AHRS)
CAPABILITIES: Final = (Capability.MISSION_INT | Capability.COMMAND_INT | Capability.SET_ATTITUDE_TARGET
                       | Capability.SET_POSITION_TARGET_LOCAL_NED | Capability.MAVLINK2)
VERSION: Final = 0x01_0F_00_FF           # 1.15.0, release: the version of PX4 whose interface this is
UINT16_UNKNOWN: Final = 65_535


@dataclass
class Telemetry:
    vehicle: Vehicle
    origin: Origin = field(default_factory=Origin)
    home_ned_m: Vector = (0.0, 0.0, 0.0)
    messages_lost: int = 0              # frames lost on the way to this vehicle, for SYS_STATUS
    next_item: int | None = None        # mission item chosen for the next start
    _armed: bool = False

    def watch(self) -> bool:
        """Update home from the vehicle's state; return True if it has changed."""
        state = self.vehicle.state()
        moved = state.armed and not self._armed
        if moved:
            self.home_ned_m = state.position_ned_m
        self._armed = state.armed
        return moved

    def build(self, name: str, now_ns: int) -> Message | None:
        """Return the message `name`; None if there is no such message, or no content now."""
        builder = BUILDERS.get(name)
        return None if builder is None else builder(self, self.vehicle.state(), now_ns)


def heartbeat(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    status = (SystemState.CRITICAL if state.failsafe else SystemState.ACTIVE if state.armed else SystemState.STANDBY)
    return message("HEARTBEAT", type=TYPE_QUADROTOR, autopilot=AUTOPILOT_PX4, mavlink_version=3,
                   base_mode=base_mode(state.mode, state.armed), custom_mode=custom_mode(state.mode),
                   system_status=status)


def sys_status(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    present = BODY_SENSORS | POSITION_SENSORS
    return message("SYS_STATUS", onboard_control_sensors_present=present, onboard_control_sensors_enabled=present,
                   onboard_control_sensors_health=present if state.position_valid else BODY_SENSORS,
                   voltage_battery=UINT16_UNKNOWN, current_battery=-1, battery_remaining=-1,
                   errors_comm=min(of.messages_lost, UINT16_UNKNOWN))


def system_time(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    return message("SYSTEM_TIME", time_boot_ms=boot_ms(now_ns))


def attitude(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    roll, pitch, yaw = roll_pitch_yaw(state.quaternion_wxyz)
    p, q, r = state.rates_radps
    return message("ATTITUDE", time_boot_ms=boot_ms(state.time_ns), roll=roll, pitch=pitch, yaw=yaw, rollspeed=p,
                   pitchspeed=q, yawspeed=r)


def attitude_quaternion(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    w, x, y, z = state.quaternion_wxyz
    p, q, r = state.rates_radps
    return message("ATTITUDE_QUATERNION", time_boot_ms=boot_ms(state.time_ns), q1=w, q2=x, q3=y, q4=z, rollspeed=p,
                   pitchspeed=q, yawspeed=r)


def local_position_ned(of: Telemetry, state: VehicleState, now_ns: int) -> Message | None:
    if not state.position_valid:
        return None
    (x, y, z), (vx, vy, vz) = state.position_ned_m, state.velocity_ned_mps
    return message("LOCAL_POSITION_NED", time_boot_ms=boot_ms(state.time_ns), x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)


def global_position_int(of: Telemetry, state: VehicleState, now_ns: int) -> Message | None:
    if not state.position_valid:
        return None
    north, east, down = state.position_ned_m
    latitude_e7, longitude_e7 = of.origin.to_global(north, east)
    vx, vy, vz = (centi(value) for value in state.velocity_ned_mps)
    return message("GLOBAL_POSITION_INT", time_boot_ms=boot_ms(state.time_ns), lat=latitude_e7, lon=longitude_e7,
                   alt=round((of.origin.altitude_m - down) * 1e3), relative_alt=round((of.home_ned_m[2] - down) * 1e3),
                   vx=vx, vy=vy, vz=vz, hdg=round(heading_deg(state.quaternion_wxyz) * 100) % 36_000)


def gps_raw_int(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    north, east, down = state.position_ned_m
    latitude_e7, longitude_e7 = of.origin.to_global(north, east)
    vx, vy, _ = state.velocity_ned_mps
    return message("GPS_RAW_INT", time_usec=state.time_ns // 1_000,
                   fix_type=GPS_FIX_TYPE_3D_FIX if state.position_valid else 1, lat=latitude_e7, lon=longitude_e7,
                   alt=round((of.origin.altitude_m - down) * 1e3), eph=UINT16_UNKNOWN, epv=UINT16_UNKNOWN,
                   vel=min(round(hypot(vx, vy) * 100), UINT16_UNKNOWN - 1), cog=UINT16_UNKNOWN,
                   satellites_visible=12 if state.position_valid else 0)


def home_position(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    north, east, down = of.home_ned_m
    latitude_e7, longitude_e7 = of.origin.to_global(north, east)
    return message("HOME_POSITION", latitude=latitude_e7, longitude=longitude_e7,
                   altitude=round((of.origin.altitude_m - down) * 1e3), x=north, y=east, z=down, q=(1.0, 0.0, 0.0, 0.0),
                   time_usec=now_ns // 1_000)


def extended_sys_state(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    return message("EXTENDED_SYS_STATE", landed_state=LANDED[state.landed])


def vfr_hud(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    vx, vy, vz = state.velocity_ned_mps
    return message("VFR_HUD", groundspeed=hypot(vx, vy), airspeed=hypot(vx, vy), climb=-vz,
                   alt=of.origin.altitude_m - state.position_ned_m[2],
                   heading=round(heading_deg(state.quaternion_wxyz)) % 360)


def mission_current(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    total = len(of.vehicle.mission)
    flown = state.waypoint_index
    if not total:
        mission_state = 1               # no mission
    elif flown >= total:
        mission_state = 5               # complete
    elif state.mode is Mode.MISSION:
        mission_state = 3               # active
    else:
        mission_state = 2 if flown < 0 else 4       # not started; paused
    current = max(0, min(flown, total - 1)) if of.next_item is None else of.next_item
    return message("MISSION_CURRENT", seq=current, total=total, mission_state=mission_state)


def autopilot_version(of: Telemetry, state: VehicleState, now_ns: int) -> Message:
    return message("AUTOPILOT_VERSION", capabilities=CAPABILITIES, flight_sw_version=VERSION, uid=1)


Builder = Callable[[Telemetry, VehicleState, int], "Message | None"]
BUILDERS: Final[Mapping[str, Builder]] = {
    "HEARTBEAT": heartbeat,
    "SYS_STATUS": sys_status,
    "SYSTEM_TIME": system_time,
    "GPS_RAW_INT": gps_raw_int,
    "ATTITUDE": attitude,
    "ATTITUDE_QUATERNION": attitude_quaternion,
    "LOCAL_POSITION_NED": local_position_ned,
    "GLOBAL_POSITION_INT": global_position_int,
    "MISSION_CURRENT": mission_current,
    "VFR_HUD": vfr_hud,
    "AUTOPILOT_VERSION": autopilot_version,
    "HOME_POSITION": home_position,
    "EXTENDED_SYS_STATE": extended_sys_state,
}


@cache
def names() -> dict[int, str]:
    """Return the names of the messages of `BUILDERS`, by number."""
    return {layout_of(name).id: name for name in BUILDERS}


def boot_ms(time_ns: int) -> int:
    return time_ns // MS_NS & 0xFFFF_FFFF


def centi(value: float) -> int:
    return max(-32_768, min(32_767, round(value * 100)))


def heading_deg(q: Quaternion) -> float:
    return degrees(yaw_of(q) % (2 * pi))
