"""Grants and reports over Eclipse Zenoh. `zenoh_session.py` is the only file of the project that knows Zenoh."""
