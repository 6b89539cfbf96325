"""Hosts carry the conductor's grants to the nodes and their reports back.

`inline` runs all nodes in this process (the fast host for sweeps). `process` runs each in its own OS process and
exchanges messages over Zenoh (`netem/transport/process_host.py`). The conductor uses both in the same way.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from time import perf_counter
from typing import Any, Protocol

from netem.node.node import Node
from netem.node.outside_guard import OutsideGuard
from netem.node.turn import Turn
from netem.transport.diagnosis.under_way import UnderWay
from netem.transport.placement import Placement
from netem.transport.watchdog import NodeHangs, Watchdog
from netem.wire.credible import credible
from netem.wire.errors import NodeFailure, is_interruption, programs_failed
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Grant, Hello, Life, Report


class Host(Protocol):
    def start(self) -> dict[str, Hello]:
        """Start every node; returns their hellos when all are ready (the barrier before time starts).

        Raises `NodeFailure` for a node that cannot start.
        """

    def exchange(self, grants: Sequence[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        """Send every grant and wait for every report; raises `NodeFailure` for a node that fails or does not answer."""

    def kill(self, name: str) -> None:
        """End the node in the middle of whatever it does; returns when it is gone."""

    def revive(self, name: str, life: Life) -> Hello:
        """Start a node that was killed again, as `life` says; raises `NodeFailure` if it cannot start."""

    def last_words(self, grants: Sequence[tuple[str, Grant]], within_s: float) -> list[tuple[str, Report]]:
        """After a failure, send every grant and return the reports that arrive; a missing one raises nothing."""

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        """Counters of the nodes up to now, as far as they can be read without an exchange."""

    def stop(self) -> None:
        """End every node and close every socket, in whatever state the host is."""


class InlineHost:
    """Runs all nodes in this process. `build` maps a node's name to the function that makes it, and `build_again(name,
    life)` makes one that was killed.

    In virtual time `guard` watches the programs while they run. `under_way.words[0]` is the place in `build` of the
    node whose code runs, counted from 1. With a `timeout_s`, a `Watchdog` ends a run in which that code does not
    return; after two seconds it calls `waiting` with the node's name and the seconds waited. Nodes whose programs have
    threads of their own get a `placement`.
    """

    def __init__(self, build: Mapping[str, Callable[[], Node]], guard: OutsideGuard | None = None,
                 under_way: UnderWay | None = None, timeout_s: float | None = None,
                 waiting: Callable[[Sequence[str], float], None] = lambda nodes, waited_s: None,
                 build_again: Callable[[str, Life], Node] | None = None, placement: Placement | None = None) -> None:
        self._build = build
        self._build_again = build_again
        self._guard = guard or OutsideGuard()
        self._guarded = guard is not None
        self._turn: Turn = self._guard      # the same object by its compiled base class, whose fields are read faster
        self._nodes: dict[str, Node] = {}
        self._places = {name: place for place, name in enumerate(build, 1)}
        self._running: Any = [0] if under_way is None else under_way.word_0(len(build))
        self._placement = placement
        self._watchdog: Watchdog | None = None
        if under_way is not None and timeout_s is not None:
            self._watchdog = Watchdog(list(build), under_way, timeout_s, waiting, self._turn)

    def start(self) -> dict[str, Hello]:
        failed: dict[str, tuple[str, str]] = {}
        if self._watchdog is not None:
            self._watchdog.start()
        if self._guarded:
            self._guard.begin()
        for name in self._build:
            if self._guard.refusal is not None:
                break
            self._begin(name, self._build[name], failed)
        if failed:
            raise programs_failed(failed)
        return {name: credible(name, node.hello()) for name, node in self._nodes.items()}

    def kill(self, name: str) -> None:
        self._nodes.pop(name).close()

    def revive(self, name: str, life: Life) -> Hello:
        assert self._build_again is not None, "this host cannot build a node again"
        failed: dict[str, tuple[str, str]] = {}
        self._begin(name, partial(self._build_again, name, life), failed)
        if failed:
            raise programs_failed(failed)
        return credible(name, self._nodes[name].hello())

    def _begin(self, name: str, build: Callable[[], Node], failed: dict[str, tuple[str, str]]) -> None:
        """Build a node; `failed` gets the reason and the traceback if that fails."""
        guard = self._guard
        guard.program_runs = True
        self._running[0] = self._places[name]
        try:
            self._nodes[name] = build()
            guard.check()
        except NodeHangs as error:
            raise self._hangs(name) from error
        except BaseException as error:
            if is_interruption(error):
                raise
            failed[name] = "could not start", guard.with_refusal(traceback.format_exc())
        finally:
            guard.program_runs = False
            self._returned()

    def exchange(self, grants: Sequence[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        began_s = perf_counter()
        reports = []
        failed: dict[str, tuple[str, str]] = {}
        guard, turn, running = self._guard, self._turn, self._running
        turn.program_runs = True
        for name, grant in grants:
            node = self._nodes[name]
            running[0] = self._places[name]
            try:
                reports.append((name, node.advance(grant)))
                if turn.refusal is not None:
                    guard.check()
            except NodeHangs as error:
                turn.program_runs = False
                raise self._hangs(name) from error
            except BaseException as error:
                if is_interruption(error):
                    turn.program_runs = False
                    raise
                failed[name] = f"its program failed at {node.now_ns} ns", guard.with_refusal(traceback.format_exc())
                if turn.refusal is not None:
                    break
        turn.program_runs = False
        running[0] = 0
        turn.steps += 1
        if failed:
            failure = programs_failed(failed)
            failure.counters = {name: self._nodes[name].counters() for name in failed}
            raise failure
        if self._placement is not None:
            self._placement.exchanged(len(grants), perf_counter() - began_s)
        return reports

    def last_words(self, grants: Sequence[tuple[str, Grant]], within_s: float) -> list[tuple[str, Report]]:
        """Reports with the counters of the nodes, read without running code of their programs."""
        return [(name, Report(grant.window, NEVER_NS, NEVER_NS, [], [], [], self._nodes[name].counters(), ""))
                for name, grant in grants if name in self._nodes]

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        return {name: node.counters() for name, node in self._nodes.items()}

    def stop(self) -> None:
        if self._watchdog is not None:
            self._watchdog.stop()
        self._guard.end()
        for node in self._nodes.values():
            node.close()
        self._nodes.clear()
        if self._placement is not None:
            self._placement.end()

    def _returned(self) -> None:
        self._running[0] = 0
        self._turn.steps += 1

    def _hangs(self, name: str) -> NodeFailure:
        assert self._watchdog is not None
        return NodeFailure(name, self._watchdog.reason, detail=self._watchdog.detail)
