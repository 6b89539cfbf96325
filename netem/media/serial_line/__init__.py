"""A serial line between two nodes: bytes, one after the other, in both directions at once.

    byte_clock.py     bits to nanoseconds, byte by byte
    transmitter.py    what waits at one end, and when each byte of it is over
    settings.py, serial_line.py    the keys of a scenario, and the medium
"""
