"""MAVLink 2, as an autopilot speaks it on one link.

    bytes -> framing -> signing -> link (statistics, who is meant) -> front -> services -> Vehicle
    bytes <- framing <- signing <- link <- budget <- front <- services <- Vehicle

    dialect.py              the adapter: messages of common.xml to payload bytes and back (pymavlink)
    enums.py, px4_modes.py  the numbers of the protocol that are used here
    framing.py, signing.py  bytes to frames and back; what is signed, and what is refused
    sequence_gaps.py        frames lost by source, from their sequence numbers
    link.py                 all of these as one object: bytes in, messages out, a counter for each way to fail
    geodesy.py              the flat map around the origin
    services:               heartbeat and home, telemetry, streams, commands, setpoints, parameters, mission_items,
                            missions, clocks, status_texts
    companion.py            the other end, for programs of companion computers
    front.py                the services around one vehicle: bytes in, bytes out, nothing waits
    settings.py, task.py    the keys of a scenario, and the front as a task of a board

Sources: the MAVLink developer guide (mavlink.io: serialization, message signing, and the pages of the microservices),
common.xml. What is spoken, and what not: docs/mavlink.md.
"""
