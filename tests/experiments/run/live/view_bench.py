"""A run with a view, started as `marconet run --view` in a process of its own, and a client of its WebSocket."""

from __future__ import annotations

import json
import ssl
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

from tests.experiments.run.fault_bench import PROGRAM, SCENARIO

MARCONET = [sys.executable, "-m", "marconet.command_line"]
WITHIN_S = 60.0
Json = dict[str, Any]


def scenario_in(folder: Path, length_s: float, more: str = "") -> Path:
    """Write the scenario of three beacons, of this length, with these lines after it."""
    (folder / "beacon.py").write_text(PROGRAM)
    path = folder / "faults.toml"
    path.write_text(SCENARIO.replace("length_s = 1.0", f"length_s = {length_s}") + more)
    return path


class Viewed:
    """The process of a run with a view; `url` is the address of its page."""

    def __init__(self, process: subprocess.Popen[str], out: Path) -> None:
        self.process, self.out = process, out
        assert process.stderr is not None
        line = process.stderr.readline()
        assert line.startswith(("view: http://127.0.0.1:", "view: https://127.0.0.1:")), line + process.stderr.read()
        self.url = line.split()[1]
        self.port = int(self.url.partition("1:")[2].partition("/")[0])

    @property
    def live(self) -> str:
        return self.url.replace("http", "ws", 1).replace("/?", "/live?")

    def ends(self) -> str:
        """Wait for the end of the run; return what it wrote to standard error."""
        _, said = self.process.communicate(timeout=WITHIN_S)
        return said


@contextmanager
def viewed(scenario: Path | str, out: Path, *options: str, report: bool = False) -> Iterator[Viewed]:
    without = [] if report else ["--no-report"]
    process = subprocess.Popen([*MARCONET, "run", str(scenario), "--out", str(out), *without, "--view", *options],
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        yield Viewed(process, out)
    finally:
        process.kill()
        process.communicate()


class Client:
    """A page without a browser."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.requests = 0
        self.updates: list[Json] = []
        self.scene = self.until("scene")["scene"]

    def until(self, kind: str, holds: Callable[[Json], bool] = lambda message: True) -> Json:
        until_s = time.monotonic() + WITHIN_S
        while time.monotonic() < until_s:
            found: Json = json.loads(self.connection.recv(timeout=WITHIN_S))
            if found["type"] == "update":
                self.updates.append(found)
            if found["type"] == kind and holds(found):
                return found
        raise AssertionError(f"no {kind} within {WITHIN_S:g} s")

    def ask(self, what: str, **more: Any) -> Json:
        """Give a command and return its answer."""
        self.requests += 1
        self.connection.send(json.dumps({"type": "command", "client": 0, "request": self.requests, "what": what,
                                         **more}))
        return self.until("answer", lambda answer: answer["request"] == self.requests)

    def fault(self, kind: str, **keys: str) -> Json:
        return self.ask("fault", kind=kind, keys=keys)


@contextmanager
def client_of(run: Viewed, certificates: ssl.SSLContext | None = None) -> Iterator[Client]:
    with connect(run.live, ssl=certificates, close_timeout=1) as connection:
        yield Client(connection)
