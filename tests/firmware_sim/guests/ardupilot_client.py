"""Stands in for ArduPilot's SITL, which cannot be had here: written from the description of its JSON interface.

    ardupilot_client.py PORT TELEMETRY_PORT GOAL_M [WHAT]

It sends servo outputs at 400 Hz of its time and blocks until the answer; it sends a frame again after 1 s. It finds the
numbers in the answer as ArduPilot does, by searching for keys. WHAT: "twice" sends each frame twice, "noise" sends
garbage, "stops" ends at 1 s, "reset" counts from 1 again at 1 s, "wide" sends 32 channels. It prints one JSON line.
"""

from __future__ import annotations

import json
import random
import re
import socket
import struct
import sys
import time

from pilot import commands

RATE_HZ = 400
PATIENCE = 3                # times that it sends a frame; then the run is over


def numbers(text: str, section: str, key: str) -> list[float]:
    """Return the numbers behind `key`, searched from the first place of `section`, up to the next that is none."""
    place = text.index(f'"{key}"', text.index(f'"{section}"') if section else 0)
    found = re.match(r'"\w+": ?\[?([^\]"}]*)', text[place:])[1]
    return [float(word) for word in found.strip(", ").split(",")]


def main(port: int, telemetry_port: int, goal_m: float, what: str = "") -> None:
    physics = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    physics.settimeout(1.0)
    telemetry = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    telemetry.setblocking(False)
    seen = {"answers": 0, "resent": 0, "copies": 0, "steps_right": True, "height_m": 0.0, "heard": 0, "rest_z": None}
    four, last_s, count = [0.0] * 4, None, 0
    rng = random.Random(5)
    while True:
        count += 1
        if what == "reset" and last_s is not None and 1.0 < last_s < 1.0 + 1.5 / RATE_HZ:
            count = 1
        if what == "stops" and last_s is not None and last_s > 1.0:
            break
        pwm = [round(1000 + 1000 * min(max(each, 0.0), 1.0)) for each in four] + [1500] * 12
        frame = struct.pack("<HHI16H", 18458, RATE_HZ, count, *pwm)
        if what == "wide":
            frame = struct.pack("<HHI32H", 29569, RATE_HZ, count, *pwm, *[0] * 16)
        if what == "noise":
            physics.sendto(rng.randbytes(rng.randrange(60)), ("127.0.0.1", port))
        if count % 40 == 1:
            telemetry.sendto(b"\xfd" + bytes(11), ("127.0.0.1", telemetry_port))
        answer = b""
        tries = 0
        while tries < PATIENCE:
            try:
                physics.sendto(frame, ("127.0.0.1", port))
                if what == "twice":
                    physics.sendto(frame, ("127.0.0.1", port))
                answer = physics.recv(65536)
                break
            except TimeoutError:
                seen["resent"] += 1                 # the physics has it, and will answer both
                tries += seen["answers"] > 0
            except ConnectionRefusedError:          # nobody listens yet, or any more; the frame is lost
                tries += seen["answers"] > 0
                time.sleep(0.01)
        if not answer:
            break
        if numbers(answer.decode(), "", "timestamp")[0] == last_s:      # the answer to the copy of the last frame
            seen["copies"] += 1
            try:
                answer = physics.recv(65536)
            except TimeoutError:
                break
        text = answer.decode()
        assert (text[0], text[-1]) == ("\n", "\n"), text
        now_s = numbers(text, "", "timestamp")[0]
        if last_s is not None:
            seen["steps_right"] &= abs(now_s - last_s - 1 / RATE_HZ) < 1e-6
        last_s = now_s
        seen["answers"] += 1
        down = numbers(text, "", "position")[2]
        velocity = numbers(text, "", "velocity")
        seen["rest_z"] = numbers(text, "imu", "accel_body")[2] if seen["rest_z"] is None else seen["rest_z"]
        seen["height_m"] = -down
        four = commands(-down, -velocity[2], numbers(text, "", "quaternion"), numbers(text, "imu", "gyro"), goal_m)
        try:
            while telemetry.recv(4096):
                seen["heard"] += 1
        except BlockingIOError:
            pass
    print(json.dumps(seen), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), *sys.argv[4:])
