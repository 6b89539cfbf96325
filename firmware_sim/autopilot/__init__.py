"""The flight controller of a quadrotor: attitude and position loops, modes and failsafes on the board's local clock.

    vehicle.py    what the MAVLink front calls: the contract between the two halves
"""
