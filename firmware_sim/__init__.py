"""What runs on the robot's microcontrollers: the local clock, schedules on it, resynchronization, boards."""
