"""A run with a view: sends the view's server updates of the run, and carries out the commands of its pages.

`Pace` in a run in real time, `Steering` in one in virtual time, watches the socket to the server and calls `LiveRun`
when a message has arrived.
"""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from experiments.run.injection import Injection, parse_value
from experiments.run.live.server_process import ServerProcess
from experiments.run.live.steering import Steering
from experiments.run.live.tally import Tally
from experiments.run.own_doors import told_of
from experiments.scenario.model import Scenario
from experiments.show.view.messages import Answer, Ask, Command, Scene, Update, Watching
from experiments.show.view.scene import scene_of
from netem.emulator.conductor import Conductor
from netem.gateways import Attends
from netem.records import Feed
from netem.records.ledger import Ledger
from netem.wire.level import Level

PAGE_WITHIN_S: Final = 30.0         # for a page to be opened before a run in virtual time begins
SPEED_OVER_S: Final = 1.0
Tell = Callable[[int, str, str, Level], None]       # an event about the wall clock: time [ns], kind, detail


class LiveRun:
    """Subscribes to `feed`, before the first grant. `tell` records an event about the wall clock."""

    def __init__(self, server: ServerProcess, scenario: Scenario, feed: Feed, conductor: Conductor, tell: Tell) -> None:
        self._server, self._scenario, self._conductor, self._tell = server, scenario, conductor, tell
        self._tally = Tally(scenario, feed)
        self._steering: Steering | None = None
        self._injection: Injection | None = None
        self._ledger: Ledger | None = None
        self._attended: Attends | None = None
        self._leave_door: Callable[[], None] = lambda: None
        self._past: deque[tuple[float, int]] = deque()          # (wall clock [s], virtual time [ns])

    def begin(self, injection: Injection, ledger: Ledger, attends: Attends, steering: Steering | None,
              folder: Path) -> None:
        """Show the scene; in virtual time, wait for a page to be opened."""
        self._injection, self._ledger, self._steering, self._attended = injection, ledger, steering, attends
        self._server.send(Scene(scene_of(self._scenario, injection.site, str(folder), real_time=steering is None)))
        attends.attend(self._server.socket, self._hear)
        if self._server.door is not None:
            self._leave_door = self._server.door.begin(attends, told_of("view", self._event_now))
        if steering is None:
            return
        print(f"view: the run waits up to {PAGE_WITHIN_S:g} s for its page to be opened", file=sys.stderr, flush=True)
        if not steering.await_page(PAGE_WITHIN_S):
            print(f"no page was opened within {PAGE_WITHIN_S:g} s: the run goes as fast as it can until one is",
                  file=sys.stderr)

    def finish(self, reached_ns: int) -> None:
        """Take no more commands, and send a last update of the run, which ended at `reached_ns`."""
        if self._attended is not None:
            self._leave()
            self._update(reached_ns)

    def _leave(self) -> None:
        if self._attended is not None:
            self._attended.leave(self._server.socket)
            self._leave_door()
            self._attended = None

    def _hear(self) -> None:
        messages, asked = self._server.receive(), False
        if messages is None:
            self._leave()
            if self._steering is not None:
                self._steering.watched(0)
            return
        for message in messages:
            match message:
                case Ask():
                    asked = True
                case Watching(pages):
                    if self._steering is not None:
                        self._steering.watched(pages)
                case Command():
                    self._server.send(self._do(message))
                case _:
                    pass
        if asked and self._server.takes_more:
            self._update(self._now_ns())

    def _do(self, command: Command) -> Answer:
        answer = Answer(command.client, command.request)
        if command.what == "fault":
            return self._inject(command, answer)
        if self._steering is None:
            answer.error = "a run in real time follows the wall clock: it has no pause and no other speed"
            return answer
        match command.what:
            case "pause":
                self._steering.pause()
                answer.told = "paused"
            case "go":
                self._steering.go()
                answer.told = "goes on"
            case "speed":
                if command.speed is not None and not 1e-3 <= command.speed <= 1e6:
                    answer.error = f"speed={command.speed:g}: expected 0.001 <= speed <= 1000000"
                    return answer
                self._steering.choose(command.speed)
                answer.told = "as fast as possible" if command.speed is None else f"{command.speed:g} x real time"
        self._event_now("view", answer.told, Level.INFO)
        return answer

    def _inject(self, command: Command, answer: Answer) -> Answer:
        assert self._injection is not None
        keys = {key: parse_value(text) for key, text in command.keys.items()}
        done = self._injection.inject(command.kind, keys)
        if done.error:
            answer.error, answer.fields = done.error, done.fields
        else:
            answer.told = f"{done.name}: {command.kind} at {done.at_ns / 1e9:.9g} s"
        return answer

    def _event_now(self, kind: str, detail: str, level: Level) -> None:
        self._tell(self._now_ns(), kind, detail, level)

    def _now_ns(self) -> int:
        conductor, pace = self._conductor, self._conductor.pace
        now_ns = max(conductor.passed_ns, conductor.reached_ns)
        return now_ns if pace is None else min(max(now_ns, pace.now_ns()), conductor.end_ns)

    def _update(self, now_ns: int) -> None:
        assert self._ledger is not None
        self._ledger.keep()
        steering, pace = self._steering, self._conductor.pace
        new, changed = self._tally.links()
        self._server.send(Update(
            now_ns, self._speed(now_ns), steering is not None and steering.paused,
            1.0 if steering is None else steering.speed, new, changed, self._tally.positions(), self._away(now_ns),
            self._tally.events(), self._tally.events_total, None if pace is None else pace.totals(),
            self._tally.samples() if self._server.with_foxglove else {}))

    def _speed(self, now_ns: int) -> float:
        now_s = time.monotonic()
        self._past.append((now_s, now_ns))
        while len(self._past) > 2 and self._past[1][0] < now_s - SPEED_OVER_S:
            self._past.popleft()
        then_s, then_ns = self._past[0]
        return (now_ns - then_ns) * 1e-9 / (now_s - then_s) if now_s > then_s else 0.0

    def _away(self, now_ns: int) -> Mapping[str, str]:
        return {name: "stands still" if seat.pause is not None else "dead"
                for name, seat in self._conductor.seats.items() if seat.away_until_ns > now_ns}
