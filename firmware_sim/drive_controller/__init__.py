"""The drive controller of a ground robot: wheel setpoints in and odometry out over CAN, a speed loop in between.

    drive.dbc            the messages on the bus
    drive_messages.py    messages as programs see them, frames as the port carries them: for both ends of the bus
    setpoint_watch.py    running, stopped or stale
    setpoint_ramp.py     what the wheels are to do, down to zero where nobody says
    wheel_encoder.py     angle to counts, counts to speed
    speed_loop.py        PI control of one wheel with anti-windup
    drive_settings.py    the keys of a scenario
    drive_controller.py  the board's program
"""
