"""Programs for the swarm: each promises silence in another way."""

from __future__ import annotations

from dataclasses import dataclass

from netem.media.can.frame import CanFrame, pack


@dataclass(frozen=True)
class Settings:
    period_ns: int
    offset_ns: int = 0
    identifier: int = 1


class Robot:
    """Records what its clock reads; subclasses say when they send."""

    Settings = Settings

    def __init__(self, board, settings):
        self.board, self.settings, self.sent = board, settings, 0
        board.record("local", "ns", lambda: board.now_ns)
        board.record("sent", "1", lambda: self.sent)

    def say(self):
        self.sent += 1
        for name in self.board.ports:
            frame = CanFrame(self.settings.identifier, self.sent.to_bytes(8, "little"))
            self.board.port(name).send(pack(frame) if name == "bus" else self.sent.to_bytes(8, "little"))


class Timed(Robot):
    """Listens only, and sends by a timer: its promises are firm."""

    def __init__(self, board, settings):
        super().__init__(board, settings)
        for name in board.ports:
            board.port(name, lambda frame: board.count("heard"), listen_only=True)
        board.every(settings.period_ns, self.say, offset_ns=settings.offset_ns)


class Replying(Robot):
    """Sends by a timer, and answers each tenth frame that it hears."""

    def __init__(self, board, settings):
        super().__init__(board, settings)
        self.heard = 0
        for name in board.ports:
            board.port(name, self.hear)
        board.every(settings.period_ns, self.say, offset_ns=settings.offset_ns)

    def hear(self, frame):
        self.heard += 1
        self.board.count("heard")
        if self.heard % 10 == 0:
            self.say()


class Looping(Robot):
    """A generator that sleeps, at random times of its own stream."""

    def __init__(self, board, settings):
        super().__init__(board, settings)
        for name in board.ports:
            board.port(name, lambda frame: board.count("heard"))

    def run(self):
        at_ns = self.board.now_ns + self.settings.offset_ns
        while True:
            yield from self.board.sleep_until(at_ns)
            self.say()
            at_ns += round(self.settings.period_ns * (0.5 + self.board.rng.random()))
