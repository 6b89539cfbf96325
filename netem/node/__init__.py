"""A node, in the robot's own process: its event loop, its ports, and the guard that keeps its program inside."""
