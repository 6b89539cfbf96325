"""A station in pymavlink that drives the rover in C; `python drive_rover.py DEVICE` prints as JSON what it saw."""

import json
import sys
import time

from pymavlink import mavutil


def drive(device):
    """Read and set parameters, arm, drive half a metre ahead, disarm, ping; return what the rover said."""
    link = mavutil.mavlink_connection(device, baud=57_600, source_system=255)

    def until(kind, accept=lambda message: True, say=lambda: None):
        """Say something until a message is accepted: a frame may be lost or damaged."""
        end_s = time.monotonic() + 30.0
        while time.monotonic() < end_s:
            say()
            message = link.recv_match(type=kind, blocking=True, timeout=0.1)
            if message is not None and accept(message):
                return message
        raise TimeoutError(f"no {kind}")

    def command(number, *parameters):
        padded = (*parameters, *[0] * (7 - len(parameters)))
        return until("COMMAND_ACK", lambda ack: ack.command == number,
                     lambda: link.mav.command_long_send(1, 1, number, 0, *padded)).result

    heartbeat = until("HEARTBEAT", say=lambda: link.mav.heartbeat_send(6, 8, 0, 0, 0))
    found = {index: until("PARAM_VALUE", lambda value, index=index: value.param_index == index,
                          lambda index=index: link.mav.param_request_read_send(1, 1, b"", index))
             for index in range(3)}
    speed = until("PARAM_VALUE", lambda value: value.param_id == "SPEED_MAX" and value.param_value == 0.75,
                  lambda: link.mav.param_set_send(1, 1, b"SPEED_MAX", 0.75, 9)).param_value
    results = [command(400, 1), command(511, 32, 50_000), command(22)]
    at = until("LOCAL_POSITION_NED", lambda at: at.y > 0.5, lambda: link.mav.manual_control_send(1, 1000, 0, 0, 0, 0))
    armed = until("HEARTBEAT").base_mode & mavutil.mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    results.append(command(400, 0))
    ping = until("PING", say=lambda: link.mav.ping_send(1, 9, 0, 0)).seq
    link.close()
    return {"type": heartbeat.type, "parameters": {value.param_id: value.param_value for value in found.values()},
            "speed": speed, "results": results, "east_m": at.y, "speed_mps": at.vy, "armed": armed, "ping": ping}


if __name__ == "__main__":
    print(json.dumps(drive(sys.argv[1])), flush=True)
