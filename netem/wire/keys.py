"""Every Zenoh key of the project: marconet/<run>/{grant,report}/<node>."""

from __future__ import annotations


def grant(run: str, node: str) -> str:
    """Key on which the emulator sends grants to `node`."""
    return f"marconet/{run}/grant/{node}"


def report(run: str, node: str = "*") -> str:
    """Key on which `node` sends its reports; the emulator subscribes to node "*", which matches every node."""
    return f"marconet/{run}/report/{node}"


def node_of(key: str) -> str:
    return key.rsplit("/", 1)[-1]
