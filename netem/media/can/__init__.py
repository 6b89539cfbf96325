"""A CAN bus (ISO 11898-1:2015, classical CAN and CAN FD) whose frame times come from the real bits.

    frame.py               the bytes that nodes send and receive: the structs of SocketCAN
    crc.py, stuffing.py    checksums and stuff bits, by table
    encoded_frame.py       a frame's bits at either bit rate and its rank in arbitration, without its bits one by one
    bit_sequence.py        its bits one by one with their fields, for frames with errors
    bit_clock.py           converts bits to nanoseconds
    transmit_queue.py      the frames that wait in one controller
    error_frame.py, same_identifier.py, fault_confinement.py, bus_off_recovery.py    errors and their consequences
    bit_errors.py          draws the bits that are inverted
    messages.py, response_time.py    what a scenario declares, and whether the bus can carry it (Davis et al. 2007)
    settings.py, bus.py    the keys of a scenario, and the medium: queues, arbitration, frames without errors
    bus_state.py, error_handling.py    what every transmission changes; transmissions in which something can go wrong
"""
