"""Cost of lockstep in marconet, HELICS and mosaik: N processes, one 40-byte message to the ring neighbour per window.

`python -m benchmarks.lockstep.compare` compares the three; `ring.py` defines the work.
"""
