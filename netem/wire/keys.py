"""Every Zenoh key of the project: marconet/<run>/{grant,report}/<node>, grant/<node>/<n> in the n-th life after a kill.

A life has a key of its own: the subscription of a process that was killed may outlive it for a moment.
"""

from __future__ import annotations


def grant(run: str, node: str, life: int = 0) -> str:
    """Key on which the emulator sends grants to `node` in its `life`, 0 before it is killed for the first time."""
    return f"marconet/{run}/grant/{node}" + (f"/{life}" if life else "")


def report(run: str, node: str = "*") -> str:
    """Key on which `node` sends its reports; the emulator subscribes to node "*", which matches every node."""
    return f"marconet/{run}/report/{node}"


def node_of(key: str) -> str:
    return key.rsplit("/", 1)[-1]
