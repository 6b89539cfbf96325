"""Numbers of common.xml that this package uses; a test compares each with pymavlink's.

They are repeated here as types that mypy knows, and since loading the scenario of a quadrotor needs these numbers but
no message (docs/decisions/0037).
"""

from __future__ import annotations

from enum import IntEnum, IntFlag


class Command(IntEnum):
    """MAV_CMD"""

    NAV_WAYPOINT = 16
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    DO_SET_MODE = 176
    DO_SET_MISSION_CURRENT = 224
    MISSION_START = 300
    COMPONENT_ARM_DISARM = 400
    GET_HOME_POSITION = 410
    GET_MESSAGE_INTERVAL = 510
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512
    REQUEST_AUTOPILOT_CAPABILITIES = 520


class CommandResult(IntEnum):
    """MAV_RESULT"""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4


class MissionResult(IntEnum):
    """MAV_MISSION"""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM5_X = 10
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


class Frame(IntEnum):
    """MAV_FRAME"""

    GLOBAL = 0
    LOCAL_NED = 1
    MISSION = 2
    GLOBAL_RELATIVE_ALT = 3
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6
    LOCAL_OFFSET_NED = 7
    BODY_NED = 8


class ModeFlag(IntFlag):
    """MAV_MODE_FLAG"""

    CUSTOM_MODE_ENABLED = 1
    AUTO_ENABLED = 4
    GUIDED_ENABLED = 8
    STABILIZE_ENABLED = 16
    SAFETY_ARMED = 128


class SystemState(IntEnum):
    """MAV_STATE"""

    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5


class LandedState(IntEnum):
    """MAV_LANDED_STATE"""

    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class Capability(IntFlag):
    """MAV_PROTOCOL_CAPABILITY"""

    MISSION_INT = 4
    COMMAND_INT = 8
    SET_ATTITUDE_TARGET = 64
    SET_POSITION_TARGET_LOCAL_NED = 128
    MAVLINK2 = 8192


class Sensor(IntFlag):
    """MAV_SYS_STATUS"""

    SENSOR_3D_GYRO = 1
    SENSOR_3D_ACCEL = 2
    SENSOR_3D_MAG = 4
    SENSOR_ABSOLUTE_PRESSURE = 8
    SENSOR_GPS = 32
    SENSOR_ATTITUDE_STABILIZATION = 2048
    SENSOR_YAW_POSITION = 4096
    SENSOR_Z_ALTITUDE_CONTROL = 8192
    SENSOR_XY_POSITION_CONTROL = 16384
    SENSOR_MOTOR_OUTPUTS = 32768
    GEOFENCE = 1048576
    AHRS = 2097152
    PREARM_CHECK = 268435456


class PositionIgnore(IntFlag):
    """POSITION_TARGET_TYPEMASK"""

    X_IGNORE = 1
    Y_IGNORE = 2
    Z_IGNORE = 4
    VX_IGNORE = 8
    VY_IGNORE = 16
    VZ_IGNORE = 32
    AX_IGNORE = 64
    AY_IGNORE = 128
    AZ_IGNORE = 256
    FORCE_SET = 512
    YAW_IGNORE = 1024
    YAW_RATE_IGNORE = 2048


class AttitudeIgnore(IntFlag):
    """ATTITUDE_TARGET_TYPEMASK"""

    BODY_ROLL_RATE_IGNORE = 1
    BODY_PITCH_RATE_IGNORE = 2
    BODY_YAW_RATE_IGNORE = 4
    THROTTLE_IGNORE = 64
    ATTITUDE_IGNORE = 128


TYPE_QUADROTOR = 2              # MAV_TYPE
AUTOPILOT_PX4 = 12              # MAV_AUTOPILOT
PARAM_TYPE_REAL32 = 9           # MAV_PARAM_TYPE
MISSION_TYPE_MISSION = 0        # MAV_MISSION_TYPE
GPS_FIX_TYPE_3D_FIX = 3         # GPS_FIX_TYPE
FORCE_ARM = 21196.0             # second parameter of COMPONENT_ARM_DISARM: skip the checks
