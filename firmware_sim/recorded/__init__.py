"""Programs that play a recorded log on a port, each frame at its recorded time: CAN logs, tlogs, captures.

A member is a `LogPlayer` (log_player.py) with a `Settings` class that reads one format.
"""
