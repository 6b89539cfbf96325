"""An addressed packet link: datagrams from node to node or to a group, over links and switches that store and forward.

    datagram.py     the header by which a program names the destination and learns the source
    settings.py     the keys of a scenario
    routes.py       links, the shortest paths over switches, and the tree of links that a datagram takes
    under_way.py    a datagram under way: its fragments, and what each receiver has of it
    packet_network.py   the medium
"""
