"""The flight controller of a quadrotor: attitude and position loops, modes and failsafes on the board's local clock.

    vehicle.py               the interface that the MAVLink front calls
    autopilot.py             the board's program: sensors and motion capture in, motor commands out
    autopilot_settings.py    the settings in a scenario
    flight_controller.py     arming, commands, changes of mode; implements `Vehicle`
    modes.py                 the rules of each mode, and the mode after each event
    flight.py                the goal of the loops in each mode, and the phases of flight
    refusals.py              reasons why arming or a mode is refused
    failsafe.py              reactions to a lost link, motion capture or stream of targets
    mission_run.py           progress of a mission
    landing_detector.py      detects that the vehicle stands
    target_limits.py         clips or refuses targets from a link
    parameters.py            the table of parameters
    flight_loops.py          the control loops in their order:
    exposure_clock.py            stamps of motion capture on the board's clock
    position_estimator.py        position and velocity
    ramp.py                      from target to target
    position_control.py          PID to attitude and thrust
    attitude_control.py          PD to torques
    mixer.py                     torques to motor speeds
    airframe.py, frames.py   what the firmware knows of its vehicle, and its frames
"""
