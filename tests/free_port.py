"""A port of the loopback that is free now, for a program that is told its port before it listens."""

from __future__ import annotations

import os
import random
import socket

FIRST, EACH = 20_000, 1_000         # below the ports that Linux gives to those who ask for any
_given: set[int] = set()


def free_port(kind: socket.SocketKind = socket.SOCK_STREAM) -> int:
    """Return a port that neither Linux nor another worker of these tests gives away meanwhile, each once."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")) % 12
    while True:
        port = FIRST + EACH * worker + random.randrange(EACH)
        if port in _given:
            continue
        with socket.socket(socket.AF_INET, kind) as free:
            try:
                free.bind(("127.0.0.1", port))
            except OSError:
                continue
        _given.add(port)
        return port
