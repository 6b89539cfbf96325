"""Stands in for PX4, which cannot be had here: written from the public description of its simulation interface.

    px4_client.py PORT TELEMETRY_PORT GOAL_M [WHAT]

It connects (and retries, as PX4 does), asks for HIL_STATE_QUATERNION, answers every HIL_SENSOR with id 0 with a
HIL_ACTUATOR_CONTROLS of the same time once it has booted, and arms at 0.5 s of its time. Its telemetry is sent before
the answer. WHAT changes it: "silent" stops answering at 1 s, "leaves" closes at 1 s, "noise" sends garbage between
messages, "never" answers nothing at all, "slow" answers every 50th step after 100 ms only. It prints one JSON line.
"""

from __future__ import annotations

import json
import os
import random
import socket
import struct
import sys
import time

from pilot import commands
from pymavlink.dialects.v20 import common

ARMED, LOCKSTEP, BOOT_US = 128, 1, 100_000
ALL_GROUPS = (0x7, 0x38, 0x1C0, 0x1A00)


def connected(port: int) -> socket.socket:
    while True:
        try:
            found = socket.create_connection(("127.0.0.1", port))
            found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return found
        except ConnectionRefusedError:
            time.sleep(0.0005)


def main(port: int, telemetry_port: int, goal_m: float, what: str = "") -> None:
    link = connected(port)
    telemetry = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    telemetry.setblocking(False)
    parser = common.MAVLink(None)
    parser.robust_parsing = True
    out = common.MAVLink(None, srcSystem=1, srcComponent=1)
    out.robust_parsing = True
    link.sendall(out.command_long_encode(0, 0, 511, 0, 115, 5000, 0, 0, 0, 0, 0).pack(out))
    link.sendall(out.heartbeat_encode(2, 12, 0, 0, 0).pack(out))
    seen = {"sensors": 0, "gps": 0, "truths": 0, "heartbeats": 0, "times_grow": True, "groups": True, "repeats": 0,
            "heard": 0, "rest_z": None, "height_m": 0.0, "pressure_hpa": 0.0, "bad": 0}
    began_us = last_us = 0
    last_z = height = climb = 0.0
    quaternion, rates = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    ground_mm = None
    rng = random.Random(5)
    while data := link.recv(65536):
        for found in parser.parse_buffer(data) or []:
            kind = found.get_type()
            if kind == "HIL_STATE_QUATERNION":
                seen["truths"] += 1
                ground_mm = found.alt if ground_mm is None else ground_mm
                height, climb = (found.alt - ground_mm) / 1e3, -found.vz / 100
                quaternion, rates = found.attitude_quaternion, (found.rollspeed, found.pitchspeed, found.yawspeed)
                seen["height_m"] = height
            elif kind == "HIL_GPS":
                seen["gps"] += 1
            elif kind == "HEARTBEAT":
                seen["heartbeats"] += 1
            elif kind == "BAD_DATA":
                seen["bad"] += 1
            elif kind == "HIL_SENSOR" and found.id == 0:
                now_us = found.time_usec
                began_us = began_us or now_us
                seen["sensors"] += 1
                seen["times_grow"] &= now_us > last_us
                seen["groups"] &= all(found.fields_updated & group == group for group in ALL_GROUPS)
                seen["repeats"] += found.zacc == last_z
                seen["rest_z"] = found.zacc if seen["rest_z"] is None else seen["rest_z"]
                seen["pressure_hpa"] = found.abs_pressure
                last_us, last_z = now_us, found.zacc
                since_us = now_us - began_us
                if what == "never" or since_us < BOOT_US:
                    continue
                if what == "leaves" and since_us > 1_000_000:
                    print(json.dumps(seen), flush=True)
                    return
                if what == "silent" and since_us > 1_000_000:
                    continue
                if what == "noise":
                    link.sendall(rng.randbytes(rng.randrange(60)))
                if what == "slow" and seen["sensors"] % 50 == 0:
                    time.sleep(0.1)
                if since_us % 100_000 < 4_000:
                    beat = out.heartbeat_encode(2, 12, 0, 0, 0).pack(out)
                    telemetry.sendto(beat, ("127.0.0.1", telemetry_port))
                try:
                    while telemetry.recv(4096):
                        seen["heard"] += 1
                except BlockingIOError:
                    pass
                armed = since_us > 500_000
                four = commands(height, climb, quaternion, rates, goal_m) if armed else [0.0] * 4
                link.sendall(out.hil_actuator_controls_encode(now_us, four + [0.0] * 12, 1 | (ARMED if armed else 0),
                                                              LOCKSTEP).pack(out))
    print(json.dumps(seen), flush=True)


if __name__ == "__main__":
    try:
        main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), *sys.argv[4:])
    except (BrokenPipeError, ConnectionResetError, struct.error) as error:
        print(json.dumps({"ended": type(error).__name__}), flush=True)
        os._exit(0)
