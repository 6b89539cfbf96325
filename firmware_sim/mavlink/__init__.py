"""MAVLink 2, as an autopilot speaks it on one link.

    bytes -> framing -> signing -> link (statistics, addressee) -> front -> services -> Vehicle
    bytes <- framing <- signing <- link <- budget <- front <- services <- Vehicle

    dialect.py              adapter to pymavlink: messages of common.xml to payload bytes and back
    c_headers.py            the dialects as headers in C, for firmware
    enums.py, px4_modes.py  numbers of the protocol
    framing.py, signing.py  bytes to frames and back; signatures and their check
    sequence_gaps.py        frames lost per source, counted by their sequence numbers
    link.py                 all of these as one object: bytes in, messages out, a counter for each way to fail
    geodesy.py              the flat map around the origin
    services:               heartbeat and home, telemetry, streams, commands, setpoints, parameters, mission_items,
                            missions, clocks, status_texts
    companion.py            the other end, for programs of companion computers
    front.py                the services around one vehicle: bytes in, bytes out, without waiting
    settings.py, task.py    the settings in a scenario, and the front as a task of a board

Sources: the MAVLink developer guide (mavlink.io: serialization, message signing, and the pages of the microservices),
common.xml. docs/mavlink.md lists what is supported and what not.
"""
