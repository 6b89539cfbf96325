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
from netem.outside_guard import OutsideGuard, OutsideRefused


class Host(Protocol):
    def start(self) -> dict[str, Hello]:
        """Bring every node up; returns when all are ready (the barrier before time starts)."""

    def exchange(self, grants: Sequence[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        """Send every grant, wait for every report; raises `NodeFailure` for a node that does not answer."""

    def stop(self) -> None:
        """End every node, whatever happened; leaves no process and no socket."""


class InlineHost:
    """All nodes in this process. `build` maps a node's name to the function that makes it.

    `guard` watches the programs while they run, if time is virtual.
    """

    def __init__(self, build: Mapping[str, Callable[[], Node]], guard: OutsideGuard | None = None) -> None:
        self._build = build
        self._guard = guard or OutsideGuard()
        self._guarded = guard is not None
        self._nodes: dict[str, Node] = {}

    def start(self) -> dict[str, Hello]:
        failed: dict[str, tuple[str, str]] = {}
        guard = self._guard
        if self._guarded:
            guard.begin()
        for name, build in self._build.items():
            guard.program_runs = True
            try:
                self._nodes[name] = build()
                guard.check()
            except (Exception, SystemExit, OutsideRefused):
                failed[name] = "could not start", guard.with_refusal(traceback.format_exc())
                if guard.refusal is not None:
                    break
            finally:
                guard.program_runs = False
        if failed:
            raise programs_failed(failed)
        return {name: node.hello() for name, node in self._nodes.items()}

    def exchange(self, grants: Sequence[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        reports = []
        failed: dict[str, tuple[str, str]] = {}
        guard = self._guard
        guard.program_runs = True
        for name, grant in grants:
            node = self._nodes[name]
            try:
                reports.append((name, node.advance(grant)))
                if guard.refusal is not None:
                    guard.check()
            except (Exception, SystemExit, OutsideRefused):
                failed[name] = f"its program failed at {node.now_ns} ns", guard.with_refusal(traceback.format_exc())
                if guard.refusal is not None:
                    break
        guard.program_runs = False
        if failed:
            raise programs_failed(failed)
        return reports

    def stop(self) -> None:
        self._guard.end()
        self._nodes.clear()
