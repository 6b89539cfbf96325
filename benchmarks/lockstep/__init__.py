"""Lockstep cost of marconet, HELICS and mosaik: N processes, one 40-byte message to the ring neighbour per window.

`python -m benchmarks.lockstep.compare` puts the three side by side; `ring.py` says what the work is.
"""
