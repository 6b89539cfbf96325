"""Autopilots as guests: PX4 and ArduPilot, unmodified, fly our plants in lockstep with virtual time.

    plant --sensors--> Px4Guest        --HIL_SENSOR, HIL_GPS, over TCP--> PX4          the node waits for the answer
          <--motors--                  <--HIL_ACTUATOR_CONTROLS----------
    plant --state----> ArduPilotGuest  --JSON, over UDP-----------------> ArduPilot
          <--motors--                  <--servo outputs------------------
    medium <--frames-- both            <--MAVLink telemetry, over UDP---> the autopilot

The autopilot is another program's process, started by the user, that takes its time from what the node sends. While it
computes, virtual time stands still; so it belongs to the node, and its telemetry passes through the node's medium as
that of any robot. Several vehicles are several nodes, each with ports of its own.

Sources: PX4, simulation over MAVLink (HIL messages of MAVLink's common.xml; lockstep by time_usec of HIL_SENSOR);
ArduPilot, SITL with JSON (libraries/SITL/examples/JSON/readme.md).
"""
