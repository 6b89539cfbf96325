"""The process of a worker: runs points one after the other, in one interpreter, until its parent ends or closes.

    python -P -m experiments.sweep.worker DESCRIPTOR

It speaks with its parent over the socket DESCRIPTOR. What robot programs print goes nowhere. A program that ends the
process, by a crash in a plant or by `os._exit`, ends this worker; the parent starts another one.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

import msgspec

from experiments.judge.figures import Figures
from experiments.run.figures import Repeated, set_aside
from experiments.run.runner import NeedsRealTime, run
from experiments.scenario.problems import ScenarioError
from experiments.sweep.messages import (
    TRACED,
    Batch,
    Begin,
    Check,
    Checked,
    Done,
    FromWorker,
    Point,
    Ready,
    Refused,
    decode_to_worker,
    encode,
)
from fmus.errors import PlantError
from netem.impairments.traced import Trace
from netem.wire.errors import NodeFailure
from netem.wire.parent import end_with_parent

REFUSALS = (ScenarioError, NeedsRealTime, PlantError, OSError)

COLLECT_EVERY: Final = 20               # settings; a collection of the whole process takes as long as loading one


def main(descriptor: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)            # the parent ends its workers itself
    end_with_parent(signal.SIGKILL)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    parent = Connection(descriptor)
    worker: _Worker | None = None
    with suppress(EOFError, ConnectionError):
        _send(parent, Ready())
        while True:
            message = decode_to_worker(parent.recv_bytes())
            if isinstance(message, Begin):
                worker = _Worker(message, parent)
            elif worker is not None:
                worker.take(message)


def _send(parent: Connection, message: FromWorker) -> None:
    parent.send_bytes(encode(message))


class _Worker:
    def __init__(self, begin: Begin, parent: Connection) -> None:
        self._source = begin.source
        self._host = begin.host
        self._parent = parent
        self._settings = 0                                  # prepared so far
        self._prepared: tuple[Mapping[str, Any], Repeated] | None = None        # of the last setting

    def take(self, message: Check | Batch | Begin) -> None:
        try:
            if isinstance(message, Check):
                _send(self._parent, Checked([line for values in message.settings for line in self._problems(values)]))
            elif isinstance(message, Batch):
                for point in message.points:
                    _send(self._parent, Done(point.number, self._run(point)))
        except REFUSALS as error:
            _send(self._parent, Refused(str(error).splitlines()))

    def _problems(self, values: dict[str, Any]) -> list[str]:
        try:
            self._source.load(values)
        except REFUSALS as error:
            return str(error).splitlines()
        return []

    def _run(self, point: Point) -> Figures:
        if point.folder:
            return self._record(point)
        if self._prepared is None or self._prepared[0] != point.values:
            self._prepared = None                           # free the old one first
            self._prepared = point.values, Repeated(partial(self._source.load, point.values), self._host)
            set_aside(first_collect=self._settings % COLLECT_EVERY == 0)
            self._settings += 1
        return self._prepared[1].run(point.seed)

    def _record(self, point: Point) -> Figures:
        """Repeat a run with its folder, and its report or its trace."""
        scenario = self._source.load(point.values, point.seed)
        trace = Trace() if point.traced else None
        try:
            summary = run(scenario, host=self._host, out=Path(point.folder), overwrite=True, report=trace is None,
                          trace=trace).summary
        except NodeFailure as error:
            return Figures(point.seed, "", False, {}, failure=str(error))
        finally:
            if trace is not None:
                (Path(point.folder) / TRACED).write_bytes(msgspec.msgpack.encode(trace.watched))
        return Figures(point.seed, summary.ledger_hash, summary.holds, {it.key: it.value for it in summary.verdicts},
                       [it.key for it in summary.verdicts if not it.kept])


if __name__ == "__main__":
    main(int(sys.argv[1]))
