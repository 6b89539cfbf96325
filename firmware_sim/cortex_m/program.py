"""A board with an emulated Cortex-M4F and a program of one's own: an .elf file that uses the machine's registers.

    [agents.r1]
    program = "firmware_sim.cortex_m.program:CortexM"
    parameters = { image = "blink.elf", sensors = ["omega"], actuators = ["u"] }

Sensors, actuators, counters, signals and events have the numbers of their places in these lists, ports those of the
robot's media in the scenario, `values` those of its rows. The memory map and all registers: docs/cortex_m.md.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

from firmware_sim.board import Board
from firmware_sim.board_timers import Timer
from firmware_sim.cortex_m.driver import Driver
from firmware_sim.cortex_m.errors import MachineFault
from firmware_sim.cortex_m.image import read_image
from firmware_sim.cortex_m.machine import Ask, Call
from firmware_sim.cortex_m.new_machine import new_machine
from firmware_sim.frame_too_long import tell_frame_too_long
from firmware_sim.scenario_view import Own, ScenarioView

MAX_PORTS: Final = 8
MAX_MOTORS: Final = 8
MAX_FRAME_BYTES: Final = 2048
FRAMES: Final = 1                   # register PORT_KIND
CAN: Final = 2
UART: Final = 3
SILENT: Final = 1
FIRM: Final = 1


@dataclass(frozen=True)
class CortexMSettings:
    image: Path                                             # an .elf file
    clock_hz: int = 100_000_000                             # of the processor
    cycles_per_instruction: float = 0.0                     # 0: computing takes no time
    instruction_budget: int = 20_000_000                    # without sleeping; 0: no limit
    values: list[list[float]] = field(default_factory=list)
    sensors: list[str] = field(default_factory=list)        # variables of the plant
    actuators: list[str] = field(default_factory=list)
    counters: list[str] = field(default_factory=list)
    signals: list[str] = field(default_factory=list)
    events: list[str] = field(default_factory=list)
    encoders: list[str] = field(default_factory=list)       # angles of the plant [rad]
    counts_per_revolution: list[int] = field(default_factory=list)      # of each encoder
    pwms: list[str] = field(default_factory=list)           # inputs of the plant
    full_scales: list[float] = field(default_factory=list)  # of each PWM stage: its output while it is always high

    def __post_init__(self) -> None:
        check_motors(self)
        check_clock(self.clock_hz, self.cycles_per_instruction, self.instruction_budget)


def check_motors(settings: CortexMSettings) -> None:
    """Raise ValueError for encoders or PWM stages that are too many or incomplete."""
    for key, names, of_each, values in (
            ("encoders", settings.encoders, "counts_per_revolution", settings.counts_per_revolution),
            ("pwms", settings.pwms, "full_scales", settings.full_scales)):
        if len(names) > MAX_MOTORS:
            raise ValueError(f"{key}: {len(names)} names: the machine has {MAX_MOTORS}")
        if len(names) != len(values):
            raise ValueError(f"{of_each}={values}: expected one for each of the {len(names)} names in {key}")
    for counts in settings.counts_per_revolution:
        if not 1 <= counts < 2**31:
            raise ValueError(f"counts_per_revolution={settings.counts_per_revolution}: expected 1 to {2**31 - 1}")


def check_clock(clock_hz: int, cycles_per_instruction: float, instruction_budget: int) -> None:
    """Raise ValueError for a clock or cost that no processor has."""
    if not 1_000 <= clock_hz <= 1_000_000_000:
        raise ValueError(f"clock_hz={clock_hz}: expected 1000 to 1000000000")
    if not 0 <= cycles_per_instruction <= 1000:
        raise ValueError(f"cycles_per_instruction={cycles_per_instruction}: expected 0, no time, to 1000")
    if instruction_budget < 0:
        raise ValueError(f"instruction_budget={instruction_budget}: expected 0, no limit, or more")


class CortexM:
    Settings = CortexMSettings
    has_execution_time = True           # if an instruction costs something

    @staticmethod
    def check(scenario: ScenarioView, own: Own[CortexMSettings]) -> Iterator[str]:
        """Yield what is wrong with the images."""
        for name, agent in own.items():
            try:
                read_image(agent.settings.image)
            except (ValueError, RuntimeError) as error:
                yield f"{name}: {error}"
        yield from CortexM.check_ports(own)

    @staticmethod
    def check_ports(own: Own[Any]) -> Iterator[str]:
        for name, agent in own.items():
            if len(agent.media) > MAX_PORTS:
                yield f"{name}: {len(agent.media)} media: the machine has {MAX_PORTS} ports"

    @staticmethod
    def debugged_with(settings: CortexMSettings) -> tuple[Path, ...]:
        """Return the .elf file that a debugger is started with, and folders with its sources."""
        return (settings.image,)

    def __init__(self, board: Board, settings: CortexMSettings) -> None:
        self._board, self._settings = board, settings
        self._timers: dict[int, Any] = {}               # a Timer, or a number of `_delays`, by channel
        self._delays = 0
        self._send: list[Callable[[bytes], None]] = [
            board.port(name, partial(self._receive, number)).send for number, name in enumerate(board.ports)]
        self._values = [0.0] * len(settings.signals)
        image = read_image(settings.image)
        machine = new_machine(board, image, settings.clock_hz, settings.cycles_per_instruction,
                              [port_kind(board, name) for name in board.ports], settings.values,
                              unique_id(board.name))
        machine.motors(settings.counts_per_revolution, len(settings.pwms))
        for counter in settings.counters:
            board.count(counter, 0)
        board.record_all([(name, "1") for name in settings.signals], lambda: self._values)
        self._driver = Driver(machine, image, board, self, settings.cycles_per_instruction > 0,
                              settings.instruction_budget,
                              "a program waits with `wfi`, or set instruction_budget higher")
        board.at(board.now_ns, self._driver.start)

    def _receive(self, port: int, data: bytes) -> None:
        if len(data) > MAX_FRAME_BYTES:
            self._board.count("frames too long for the port")
            return
        self._driver.receive(port, data)

    # --- what the program asks for

    def carry_out(self, calls: Iterable[Call]) -> None:
        board, settings = self._board, self._settings
        for ask, number, integer, place, real in calls:
            if ask == Ask.SEND and integer < 0:
                tell_frame_too_long(board, board.ports[number], -integer)
            elif ask == Ask.SEND:
                self._send[number](self._bytes(place, integer))
            elif ask == Ask.SET_TIMER:
                self._disarm(number)
                self._timers[number] = board.at(integer, partial(self._ring, number), sends=not place & SILENT)
            elif ask == Ask.SET_DELAY:
                self._disarm(number)
                self._delays += 1
                self._timers[number] = self._delays
                board.after(max(0, integer), partial(self._delay_over, number, self._delays),
                            sends=not place & SILENT)
            elif ask == Ask.CANCEL_TIMER:
                self._disarm(number)
            elif ask == Ask.PROMISE:
                (board.promise_firm if number & FIRM else board.promise_soft)(integer)
            elif ask == Ask.ACTUATE:
                board.actuate(self._named(settings.actuators, "actuators", number), real)
            elif ask == Ask.COUNT:
                board.count(self._named(settings.counters, "counters", number), integer)
            elif ask == Ask.MISTAKE:
                raise MachineFault(f"{board.name}: its program reports a mistake with {self._text(place, integer)}, "
                                   f"number {number}, code {int(real)}")
            else:
                board.event(self._named(settings.events, "events", number), self._text(place, integer))

    def record(self, signal: int, value: float) -> None:
        self._named(self._settings.signals, "signals", signal)
        self._values[signal] = value

    def drive(self, stage: int, share: float) -> None:
        self._board.actuate(self._settings.pwms[stage], share * self._settings.full_scales[stage])

    def _bytes(self, place: int, length: int) -> bytes:
        return bytes(self._driver.machine.bytes[place:place + length])

    def _text(self, place: int, length: int) -> str:
        return self._bytes(place, length).decode(errors="replace")

    def answer(self, ask: int, number: int, integer: int, real: float) -> float | None:
        if ask == Ask.SENSE:
            return float(self._board.sense(self._named(self._settings.sensors, "sensors", number)))
        if ask == Ask.ENCODER:
            return float(self._board.sense(self._settings.encoders[number]))
        if ask == Ask.ADJUST_CLOCK:
            self._board.adjust_clock(integer, real)
            return real
        return float(self._board.rng.getrandbits(32))

    def timers_armed(self) -> bool:
        return bool(self._timers)

    def disarm_all(self) -> None:
        for channel in list(self._timers):
            self._disarm(channel)

    def _named(self, names: list[str], key: str, number: int) -> str:
        if number >= len(names):
            raise MachineFault(f"{self._board.name}: its program uses number {number} of `{key}`, which has "
                               f"{len(names)} names: add one in the scenario, or correct the program")
        return names[number]

    def _ring(self, channel: int) -> None:
        self._timers.pop(channel, None)
        self._driver.ring(channel)

    def _delay_over(self, channel: int, delay: int) -> None:
        if self._timers.get(channel) == delay:
            self._ring(channel)

    def _disarm(self, channel: int) -> None:
        armed = self._timers.pop(channel, None)
        if isinstance(armed, Timer):
            armed.cancel()


def port_kind(board: Board, port: str) -> int:
    """Return the value of the register PORT_KIND for a port."""
    return CAN if port in board.can_buses else UART if port in board.byte_streams else FRAMES


def unique_id(name: str) -> list[int]:
    """Return the 128 bits by which a program can tell its board from others, as 4 words."""
    digest = hashlib.sha256(f"marconet board {name}".encode()).digest()
    return [int.from_bytes(digest[4 * k:4 * k + 4], "little") for k in range(4)]
