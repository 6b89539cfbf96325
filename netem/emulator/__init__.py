"""Virtual time by conservative windows: nodes promise when they next hand something out, the conductor grants time.

    conductor --Grant(horizon, deliveries)--> node
    conductor <--Report(offers, promise, samples)-- node

`conductor.py` decides which node may run how far. A host (`netem/transport/hosts.py`) carries grants and reports,
`netem/node/node.py` is the node.
"""
