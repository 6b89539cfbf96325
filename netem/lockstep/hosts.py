"""Hosts: what carries grants to nodes and reports back.

`inline` calls the nodes in this process (the fast host for sweeps); `process` gives each its own OS process and talks
through Zenoh (`netem/transport/process_host.py`). The conductor cannot tell them apart.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from netem.lockstep.errors import programs_failed
from netem.lockstep.messages import Grant, Hello, Report
from netem.node import Node


class Host(Protocol):
    def start(self) -> dict[str, Hello]:
        """Bring every node up; returns when all are ready (the barrier before time starts)."""

    def exchange(self, grants: Sequence[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        """Send every grant, wait for every report; raises `NodeFailure` for a node that does not answer."""

    def stop(self) -> None:
        """End every node, whatever happened; leaves no process and no socket."""


class InlineHost:
    """All nodes in this process. `build` maps a node's name to the function that makes it."""

    def __init__(self, build: Mapping[str, Callable[[], Node]]) -> None:
        self._build = build
        self._nodes: dict[str, Node] = {}

    def start(self) -> dict[str, Hello]:
        failed: dict[str, tuple[str, str]] = {}
        for name, build in self._build.items():
            try:
                self._nodes[name] = build()
            except (Exception, SystemExit):
                failed[name] = "could not start", traceback.format_exc()
        if failed:
            raise programs_failed(failed)
        return {name: node.hello() for name, node in self._nodes.items()}

    def exchange(self, grants: Sequence[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        reports = []
        failed: dict[str, tuple[str, str]] = {}
        for name, grant in grants:
            node = self._nodes[name]
            try:
                reports.append((name, node.advance(grant)))
            except (Exception, SystemExit):
                failed[name] = f"its program failed at {node.now_ns} ns", traceback.format_exc()
        if failed:
            raise programs_failed(failed)
        return reports

    def stop(self) -> None:
        self._nodes.clear()
