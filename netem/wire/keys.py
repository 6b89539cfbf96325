"""Every Zenoh key of the project: marconet/<run>/{grant,report}/<node>."""

from __future__ import annotations


def grant(run: str, node: str) -> str:
    """The emulator grants time to `node`."""
    return f"marconet/{run}/grant/{node}"


def report(run: str, node: str = "*") -> str:
    """`node` answers; with "*" the emulator hears all."""
    return f"marconet/{run}/report/{node}"


def node_of(key: str) -> str:
    return key.rsplit("/", 1)[-1]
