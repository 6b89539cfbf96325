"""Virtual time by conservative windows: each node promises when it makes its next offer, and the conductor grants time.

    conductor --Grant(horizon, deliveries)--> node
    conductor <--Report(offers, promise, samples)-- node

`conductor.py` decides how far each node may run. A host (`netem/transport/hosts.py`) carries grants and reports;
`netem/node/node.py` runs the node's program.
"""
