"""A CAN bus (ISO 11898-1:2015, classical CAN and CAN FD) whose frame times come from the real bits.

    frame.py               what nodes hand out and get: the structs of SocketCAN
    crc.py, stuffing.py    checksums and stuff bits, by table
    encoded_frame.py       a frame's bits at either bit rate and its rank in arbitration, without its bits one by one
    bit_sequence.py        its bits one by one with their fields, for what goes wrong
    bit_clock.py           bits to nanoseconds
    transmit_queue.py      what waits in one controller
    error_frame.py, same_identifier.py, fault_confinement.py, bus_off_recovery.py    what goes wrong and what follows
    bit_errors.py          which bits are hit
    messages.py, response_time.py    what a scenario declares, and whether the bus can carry it (Davis et al. 2007)
    settings.py, bus.py    the keys of a scenario, and the medium: queues, arbitration, frames without errors
    bus_state.py, error_handling.py    what every transmission changes; transmissions in which something can go wrong
"""
