"""The robot's microcontrollers: boards and the programs on them, local clocks, schedules, resynchronization."""
