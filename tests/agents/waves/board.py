"""A board of the test's, with as much of `firmware_sim.board.Board` as robots with waves use."""

from __future__ import annotations

from collections import Counter


class Timer:
    def __init__(self, at_ns, action):
        self.at_ns, self.action = at_ns, action

    def cancel(self):
        self.action = None


class Board:
    name, now_ns, integral, ports, team, input = "r2", 0, 0.0, ("radio",), None, 0.0

    def __init__(self):
        self.counters, self.events, self.warnings, self.timers = Counter(), [], [], []

    def port(self, name, on_receive, listen_only):
        assert listen_only
        self.hear, self.sent = on_receive, []
        return self

    def send(self, frame):
        self.sent.append((self.now_ns, frame))

    def actuators(self, names):
        return self

    def write(self, values):
        (self.input,) = values

    def sensors(self, names):
        return self

    def read(self):
        return [self.integral]

    def after(self, delay_ns, action, sends):
        self.at(self.now_ns + delay_ns, action, sends)

    def count(self, name, by=1):
        self.counters[name] += by

    def record_all(self, signals, read):
        self.sample = read

    def event(self, kind, detail):
        self.events.append((self.now_ns, kind, float(detail.split()[0].strip(","))))

    def warn(self, kind, detail):
        self.warnings.append((self.now_ns, detail))

    def at(self, at_ns, action, sends=True):
        self.timers.append(Timer(at_ns, action))
        return self.timers[-1]

    def run_until(self, until_ns):
        while (due := [timer for timer in self.timers if timer.action and timer.at_ns <= until_ns]):
            timer = min(due, key=lambda timer: timer.at_ns)
            self.now_ns, action, timer.action = timer.at_ns, timer.action, None
            action()
        self.now_ns = until_ns
