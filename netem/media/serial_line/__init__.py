"""A serial line between two nodes: bytes, one after the other, in both directions at once.

    byte_clock.py     converts bytes to nanoseconds
    transmitter.py    the transmit buffer of one end, and when each of its bytes ends on the line
    settings.py, serial_line.py    the keys of a scenario, and the medium
"""
