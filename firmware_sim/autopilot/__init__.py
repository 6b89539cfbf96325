"""The flight controller of a quadrotor: attitude and position loops, modes and failsafes on the board's local clock.

    vehicle.py               the interface that the MAVLink front calls
    autopilot.py             the board's program: sensors and motion capture in, motor commands out
    autopilot_settings.py    the keys of a scenario
    flight_controller.py     arming, commands, changes of mode; implements the contract
    modes.py                 the table of modes, and which follows which
    flight.py                what a mode flies, and the phases of flight
    refusals.py              why something cannot be done now
    failsafe.py              what to do when something falls silent
    mission_run.py           how far a mission is
    landing_detector.py      whether it stands
    target_limits.py         targets from a link, clipped
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
