"""Hosts, which carry grants to nodes and reports back: in one process, or over Eclipse Zenoh.

`zenoh_session.py` is the only file of the project that imports Zenoh.
"""
