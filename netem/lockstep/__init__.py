"""Virtual time by conservative windows: nodes promise when they next hand something out, the conductor grants time.

    conductor --Grant(horizon, deliveries)--> node
    conductor <--Report(offers, promise, samples)-- node

`conductor.py` decides who may run how far, a host (`hosts.py`) carries grants and reports, `netem/node.py` is the node.
"""
