"""How a robot uses waves: what it sends, the force from what it hears, and the watch over the energy of its lines.

At its slot it reads the integral of its output, as an encoder or an integrating converter gives it, and sends each
neighbour the mean of the wave since its last slot (`port.py`). It needs neither its model nor its state for that, so
neither a wrong model nor a disturbance of the plant makes a line give energy. The force of its ports' dampers is in
its drive, and so in the plant; it sets the input alpha sum_j w_ij.

With `use_after_s` in the team's table a robot uses each wave that long after its slot began, by its own clock, and none
that comes later. A delay that varies less is then constant: no wave is held too long, and none is cut short.

It records what each line owes (`incoming_wave.py`) as `energy_NAME`, and the least of these as `energy`. It tells
the least as an event "wave energy" when one becomes negative and when none is any more, and warns of the first break of
each line.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from agents.waves.incoming_wave import IncomingWave
from agents.waves.team import WaveTeam
from agents.waves.wave_frame import WaveFrame
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer

BROKEN = "energy breaks"        # counter: how often one of its lines began to owe less than 0


class WaveCoupling:
    def __init__(self, board: Board, team: WaveTeam, number: int, apply: Callable[[], None]) -> None:
        self._board, self._team, self._port, self._apply = board, team, team.port, apply
        self._heard = team.neighbours[number]
        self._place = {sender: team.neighbours[sender].index(number) for sender in self._heard}
        self._lines = {sender: IncomingWave(team.round_ns, len(team.names), hold=team.when_silent == "hold")
                       for sender in self._heard}
        self._use_after_ns, self._schedule = team.use_after_ns, team.schedule
        self._waiting: set[tuple[int, int]] = set()             # senders of waves, and when these come into use
        self._timers: dict[int, Timer] = {}
        self._sent = dict.fromkeys(self._heard, 0.0)            # energy, by neighbour
        self._broken: set[int] = set()
        self._warned: set[int] = set()
        self._integral_of_output = board.sensors(["y[2]"])
        self._read_before, self._sent_ns = self._integral_of_output.read()[0], board.now_ns
        for counter in (BROKEN, "late frames", "silent waves"):
            board.count(counter, 0)
        board.record_all([("energy", "1"), *((f"energy_{team.names[sender]}", "1") for sender in self._heard)],
                         self._sample)
        board.event("wave energy", "0.0, no wave has come yet")

    def speak(self) -> list[float]:
        """Return the values of a frame: for each neighbour the mean wave since the last frame, and the energy sent."""
        board, port, tau_s = self._board, self._port, self._team.round_ns * 1e-9
        now_ns, read = board.now_ns, self._integral_of_output.read()[0]
        over_s = max(tau_s, (now_ns - self._sent_ns) * 1e-9)    # longer after a frame that it did not send
        values = []
        for neighbour, line in self._lines.items():
            outgoing = port.gain * (read - self._read_before) + port.reflection * line.take_integral(now_ns)
            wave = outgoing / over_s
            self._sent[neighbour] += wave * wave * tau_s
            values += [wave, self._sent[neighbour]]
        self._read_before, self._sent_ns = read, now_ns
        return values

    def hear(self, frame: WaveFrame) -> None:
        if frame.sender not in self._lines:
            return
        if not self._use_after_ns:
            self._use(frame)
            return
        due_ns = self._schedule.data_ns(frame.slot) + self._use_after_ns
        if due_ns < self._board.now_ns:
            self._board.count("late frames")
            return
        self._waiting.add((frame.sender, due_ns))
        self._board.at(due_ns, partial(self._use_now_due, frame, due_ns), sends=False)

    def _use_now_due(self, frame: WaveFrame, due_ns: int) -> None:
        self._waiting.discard((frame.sender, due_ns))
        self._use(frame)

    def _use(self, frame: WaveFrame) -> None:
        sender, now_ns = frame.sender, self._board.now_ns
        wave, sent = frame.values[2 * self._place[sender]:2 * self._place[sender] + 2]
        line = self._lines[sender]
        if not line.arrive(frame.slot, wave, sent, now_ns):
            self._board.count("old frames")
            return
        if sender in self._timers:
            self._timers.pop(sender).cancel()
        if line.ends_ns is not None:
            self._timers[sender] = self._board.at(line.ends_ns, partial(self._end, sender), sends=False)
        elif line.breaks_ns is not None:
            self._timers[sender] = self._board.at(line.breaks_ns, partial(self._break, sender), sends=False)
        if sender in self._broken and line.owed(now_ns) >= 0:
            self._broken.remove(sender)
            if not self._broken:
                self._tell()
        self._apply()

    def control(self) -> float:
        return self._port.gain * sum(line.wave for line in self._lines.values())

    def _end(self, sender: int) -> None:
        if (sender, self._board.now_ns) in self._waiting:       # the next wave comes into use at this instant
            return
        self._lines[sender].fall_silent(self._board.now_ns)
        self._board.count("silent waves")
        self._apply()

    def _break(self, sender: int) -> None:
        board, name, line = self._board, self._team.names[sender], self._lines[sender]
        if sender not in self._broken:
            self._broken.add(sender)
            board.count(BROKEN)
            self._tell()
        if sender not in self._warned:
            self._warned.add(sender)
            board.warn("assumption violated", f"passivity of the line {name} -> {board.name}: it owes "
                       f"{line.owed(board.now_ns):.6g}, expected 0 or more: it holds the wave {line.wave:.6g} for "
                       f"longer than {self._team.round_ns} ns, as its frame is late or lost")

    def _sample(self) -> list[float]:
        now_ns = self._board.now_ns
        owed = [line.owed(now_ns) for line in self._lines.values()]
        return [min(owed), *owed]

    def _tell(self) -> None:
        now_ns = self._board.now_ns
        sender = min(self._lines, key=lambda other: self._lines[other].owed(now_ns))
        self._board.event("wave energy", f"{self._lines[sender].owed(now_ns)!r} owed by the line from "
                                         f"{self._team.names[sender]}")
