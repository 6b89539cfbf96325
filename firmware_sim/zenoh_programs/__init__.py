"""Unmodified Python programs of Eclipse Zenoh in virtual time, on the media of their nodes.

    with zenoh.open(zenoh.Config()) as session:         # of a function that is an agent's program
        session.put("rover/pose", b"...")               # a frame on the medium that the scenario gives to this key

    replaced.py         what is replaced in the library's modules, by thread
    session.py          Session, and what it opens: entities.py, liveliness.py, matching.py
    station.py          the node on its media: frames out and in, neighbours.py, tokens.py, timers.py
    asking.py           a query where it is asked; answering.py where it is answered
    channels.py         handlers and callbacks; sample.py, values.py, hybrid_clock.py
    outside_subset.py   the error for everything else

The library's own code runs for values only (KeyExpr, ZBytes, Encoding, Selector, Parameters, Timestamp, Config): no
session, thread or socket of it is opened. The scenario's side is docs/zenoh_programs.md.
"""
