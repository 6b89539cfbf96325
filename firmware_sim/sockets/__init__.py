"""Sockets and asyncio of blocking programs (`firmware_sim/blocking`) in virtual time: datagrams are frames of media.

    socket.socket(AF_INET, SOCK_DGRAM) --> udp_socket.py --> stack.py --> udp_packet.py --> port of the node
    select, poll, selectors, asyncio   --> readiness.py: a thread waits until one of several sockets is readable

    interface.py        the scenario's choice of a medium, with the addresses of its nodes
    stack.py            one network stack for each program: ports, routes, delivery to sockets
    udp_packet.py       the bytes of an IPv4 packet with a UDP datagram
    udp_socket.py, pair_socket.py    the sockets that a program gets
    virtual_files.py    what they have in common, by file descriptor; what is refused by name
    readiness.py, polling.py         waiting for several of them
    library_sockets.py  which names of the standard library are replaced

Only threads of blocking programs get these sockets; every other thread of the process gets the standard library's.
"""
