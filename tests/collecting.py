"""Workers of pytest-xdist collect one behind the other, so that a fresh clone is compiled once and not by each of them.

Each worker imports every test file with what it imports. The first one leads: it collects at full speed and adds a byte
to a file for each test file. The others collect a test file once the leader has, and find its bytecode on the disk.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Generator
from pathlib import Path
from typing import Any, Final

import pytest

LEADER: Final = "gw0"
GO_ON_AFTER_S: Final = 30.0         # without a step of the leader: it has ended, or needs that long for one file
LOOK_EVERY_S: Final = 0.02
PROGRESS: Final = "collected"       # key of the file's path in what a worker gets


class Lead:
    """Plugin of the process that starts the workers: makes the file, and removes it at the end."""

    def __init__(self) -> None:
        handle, path = tempfile.mkstemp(prefix="collected-")
        os.close(handle)
        self._file = Path(path)

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        node.workerinput[PROGRESS] = str(self._file)

    def pytest_unconfigure(self) -> None:
        self._file.unlink(missing_ok=True)


class InLine:
    """Plugin of a worker."""

    def __init__(self, worker: str, file: Path) -> None:
        self._leads, self._file = worker == LEADER, file
        self._modules = 0
        self._alone = False         # the leader has not gone on

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Generator[None, Any, Any]:
        if not isinstance(collector, pytest.Module):
            return (yield)
        self._modules += 1
        if self._leads:
            try:
                return (yield)
            finally:
                with self._file.open("ab") as file:
                    file.write(b".")
        self._await_leader()
        return (yield)

    def _await_leader(self) -> None:
        seen, since_s = -1, time.monotonic()
        while not self._alone and (collected := self._file.stat().st_size) < self._modules:
            if collected != seen:
                seen, since_s = collected, time.monotonic()
            self._alone = time.monotonic() - since_s > GO_ON_AFTER_S
            time.sleep(LOOK_EVERY_S)


def register(config: pytest.Config) -> None:
    given: dict[str, Any] | None = getattr(config, "workerinput", None)
    if given is None and getattr(config.option, "numprocesses", None):
        config.pluginmanager.register(Lead())
    elif given is not None and PROGRESS in given:
        config.pluginmanager.register(InLine(given["workerid"], Path(given[PROGRESS])))
