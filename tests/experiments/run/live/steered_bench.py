"""A run in virtual time with a view that is steered from this process, without a server, a page or a wait.

The script acts whenever the run attends to its view: at the stops of `Steering`, and after windows, here after each.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from experiments.judge.run_data import load_run
from experiments.run.live import steering
from experiments.run.live.server_process import ServerProcess
from experiments.run.runner import run
from experiments.scenario import load
from experiments.show.view.messages import Answer, Ask, Command, Scene, ToRun, Update, Watching
from netem.emulator import conductor
from netem.emulator.conductor import Conductor
from netem.records.events import hash_of_events
from netem.records.ledger_file import read_metadata

SPEED = 1e6                         # virtual seconds a second of the wall clock: the run is never held
Script = Callable[["SteeredView"], None]


def hashes(folder: Path) -> tuple[str, str]:
    return read_metadata(folder / "ledger.parquet")["hash"], hash_of_events(load_run(folder).events)


class SteeredView(ServerProcess):
    """Stands in for the server of a view; `script(view)` is called at each occasion to steer the run.

    `now_ns` is the virtual time up to which windows have passed, and `answers` has what became of the commands of
    `fault`, which the run takes at once.
    """

    def __init__(self, script: Script) -> None:
        self.socket, self._other = socket.socketpair()
        self._other.send(b"x")      # never read: the socket can always be read
        self.with_foxglove, self.door = False, None
        self.steering: steering.Steering | None = None
        self.answers: list[Answer] = []
        self._script = script
        self._commands: list[ToRun] = [Watching(1), Command(0, 0, "speed", speed=SPEED)]

    def fault(self, kind: str, **keys: str) -> None:
        self._commands.append(Command(0, 1, "fault", kind, keys))

    def say(self, message: ToRun) -> None:
        self._commands.append(message)

    @property
    def now_ns(self) -> int:
        assert self.steering is not None
        return self.steering._conductor.passed_ns

    @property
    def takes_more(self) -> bool:
        return True

    def send(self, message: Any) -> None:
        match message:
            case Answer(request=1):
                self.answers.append(message)
            case _:
                assert isinstance(message, Scene | Update | Answer)

    def receive(self) -> list[ToRun] | None:
        self._script(self)
        commands, self._commands = self._commands, []
        return [*commands, Ask()]

    def close(self, within_s: float = 0.0) -> None:
        self.socket.close()
        self._other.close()


def steered(scenario: Path, out: Path, script: Script, patch: pytest.MonkeyPatch, stop_every_ns: int) -> SteeredView:
    """Run the scenario with this script, held at a stop every `stop_every_ns` of virtual time; return the view."""
    patch.setattr(conductor, "PROGRESS_EVERY_S", 0.0)
    patch.setattr(steering, "PACED_S", stop_every_ns * 1e-9 / SPEED)
    view = SteeredView(script)

    class Noted(steering.Steering):
        def __init__(self, conductor: Conductor) -> None:
            super().__init__(conductor)
            view.steering = self

    patch.setattr(steering, "Steering", Noted)
    try:
        run(load(scenario), host="inline", out=out, report=False, view=view)
    finally:
        view.close()
    return view


def repeated(scenario: Path, run_folder: Path, out: Path) -> tuple[str, str]:
    """Run the scenario with what was injected into the run in `run_folder`; return its hashes."""
    injected = run_folder / "injected.toml"
    again = scenario.with_name(f"{out.name}.toml")
    again.write_text(scenario.read_text() + (injected.read_text() if injected.exists() else ""))
    run(load(again), host="inline", out=out, report=False)
    return hashes(out)
