"""The drive controller of a ground robot: wheel setpoints in and odometry out over CAN, a speed loop in between.

    drive.dbc            the messages on the bus
    drive_messages.py    packs and unpacks the messages, for both ends of the bus
    setpoint_watch.py    state of the drive: running, stopped or stale
    setpoint_ramp.py     reference speeds of the wheels, ramped to zero unless running
    wheel_encoder.py     angle to counts, counts to speed
    speed_loop.py        PI control of one wheel with anti-windup
    drive_settings.py    the settings in a scenario
    drive_controller.py  the board's program
"""
