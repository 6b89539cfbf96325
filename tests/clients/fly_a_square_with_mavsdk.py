"""A client that knows nothing of marconet: MAVSDK flies an offboard square and lands.

    python fly_a_square_with_mavsdk.py udpin://127.0.0.1:14540 HEIGHT_M SIDE_M

Prints one line of JSON for each thing it has seen; ends with 0 if it got through.
"""

import asyncio
import json
import sys
from math import dist

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.offboard import PositionNedYaw
from mavsdk.plugins.telemetry import LandedState

REACHED_M = 0.3
PATIENCE_S = 30.0


def tell(what, **values):
    print(json.dumps({"what": what, **values}), flush=True)


async def first(stream, wanted):
    """The first of a stream that is as wanted."""
    async def wait():
        async for found in stream:
            if wanted(found):
                return found
        raise RuntimeError("the stream has ended")
    return await asyncio.wait_for(wait(), PATIENCE_S)


def place(found):
    return found.position.north_m, found.position.east_m, found.position.down_m


async def fly(url, height_m, side_m):
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(url)
        system = await mavsdk.first_autopilot(timeout_s=PATIENCE_S)
        tell("connected", system=await system.get_system_id())
        telemetry, action, offboard = TelemetryAsync(system), ActionAsync(system), OffboardAsync(system)
        await first(telemetry.subscribe_health_all_ok(), lambda ok: ok)
        where = await first(telemetry.subscribe_position(), lambda found: True)
        tell("healthy", latitude_deg=where.latitude_deg, longitude_deg=where.longitude_deg)
        await telemetry.set_rate_position_velocity_ned(20.0)
        await action.set_takeoff_altitude(height_m)
        await action.arm()
        await first(telemetry.subscribe_armed(), lambda armed: armed)
        tell("armed")
        await action.takeoff()
        await first(telemetry.subscribe_position_velocity_ned(),
                    lambda found: abs(place(found)[2] + height_m) < REACHED_M)
        tell("in the air", mode=str(await telemetry.flight_mode()))
        await offboard.set_position_ned(PositionNedYaw(0.0, 0.0, -height_m, 0.0))
        await offboard.start()
        for north_m, east_m in ((side_m, 0.0), (side_m, side_m), (0.0, side_m), (0.0, 0.0)):
            corner = north_m, east_m, -height_m
            await offboard.set_position_ned(PositionNedYaw(*corner, 0.0))
            found = await first(telemetry.subscribe_position_velocity_ned(),
                                lambda found, corner=corner: dist(place(found), corner) < REACHED_M)
            tell("corner", wanted=corner, found=place(found))
        await offboard.stop()
        await action.land()
        await first(telemetry.subscribe_landed_state(), lambda state: state == LandedState.ON_GROUND)
        await first(telemetry.subscribe_armed(), lambda armed: not armed)
        tell("landed")


if __name__ == "__main__":
    asyncio.run(fly(sys.argv[1], float(sys.argv[2]), float(sys.argv[3])))
