"""The messages between a drive controller and the computer that commands it, packed by a DBC file.

    Setpoint --pack--> struct of SocketCAN --bus--> unpack --> Setpoint          WheelSpeeds, Odometry, Status back

Each class here is a message of the DBC file, its fields are the signals; layout, scale, range and identifier are in the
file. `unit` is added to every identifier, so that drives on one bus differ.
"""

from __future__ import annotations

from enum import IntEnum
from math import isfinite
from pathlib import Path
from sys import float_info
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import firmware_sim.drive_controller
from netem.media.can.dbc_file import DbcError, cantools_error, read_dbc
from netem.media.can.frame import EXTENDED_MASK, STANDARD_MASK, CanFrame, pack

if TYPE_CHECKING:
    from netem.media.can.dbc_file import Message

DRIVE_DBC: Final = Path(firmware_sim.drive_controller.__path__[0], "drive.dbc")     # __file__ may be a compiled module
UNITS: Final = 16
NO_AGE_MS: Final = 0xFFFFFFFF


class Mode(IntEnum):
    STOP = 0
    RUN = 1


class DriveState(IntEnum):
    STOPPED = 0             # commanded to stop, or no setpoint has arrived yet
    RUNNING = 1
    STALE = 2               # no setpoint for `stale_after_ns`


class Setpoint(NamedTuple):
    left_radps: float
    right_radps: float
    mode: int               # Mode
    counter: int            # modulo 256


class WheelSpeeds(NamedTuple):
    left_radps: float
    right_radps: float
    state: int              # DriveState
    counter: int            # counter of the setpoint that the loop used last


class Odometry(NamedTuple):
    left_count: int         # modulo 2^32, signed
    right_count: int


class Status(NamedTuple):
    state: int              # DriveState
    counter: int            # counter of the setpoint that the loop used last
    refused: int            # number of refused setpoint frames, modulo 65536
    age_ms: int             # age of the last setpoint; NO_AGE_MS: there was none


DriveMessage = Setpoint | WheelSpeeds | Odometry | Status
MESSAGES: Final[dict[str, type[DriveMessage]]] = {
    "DriveSetpoint": Setpoint, "DriveSpeed": WheelSpeeds, "DriveOdometry": Odometry, "DriveStatus": Status,
}
WORDS: Final[dict[str, type[IntEnum]]] = {"mode": Mode, "state": DriveState}


OWN_IDENTIFIERS: Final = {"DriveSetpoint": 272, "DriveSpeed": 400, "DriveOdometry": 416, "DriveStatus": 1808}


class FrameRefused(ValueError):
    """A frame with the identifier of a drive message is invalid; the text is short enough for an event."""


class Rule(NamedTuple):
    """What the value of a signal must be: finite, within the range that the DBC file allows, and one of the words."""

    signal: str
    low: float
    high: float
    words: type[IntEnum] | None

    def admits(self, value: float) -> bool:
        return self.low <= value <= self.high and (self.words is None or value in self.words._value2member_map_)

    def broken_by(self, value: float) -> str:
        """Return what a value that is not admitted breaks."""
        said = f"{self.signal}={value:.9g}: expected"
        if self.words is not None and value not in self.words._value2member_map_:
            return f"{said} one of {', '.join(f'{word.value} {word.name}' for word in self.words)}"
        if not isfinite(value):
            return f"{said} a finite number"
        return f"{said} at least {self.low:g}" if value < self.low else f"{said} at most {self.high:g}"


def identifiers_in(file: Path, unit: int) -> list[tuple[int, bool]]:
    """Return (identifier, whether it is extended) of each message of the drive `unit`; raises as `DriveMessages` does.

    For marconet's own file, known to be valid, cantools is not imported: that takes longer than the rest of a check.
    """
    if file == DRIVE_DBC:
        return [(OWN_IDENTIFIERS[name] + unit, False) for name in MESSAGES]
    return DriveMessages(file, unit).identifiers()


class DriveMessages:
    """Packs and unpacks the messages of the drive `unit` of a bus."""

    def __init__(self, file: Path = DRIVE_DBC, unit: int = 0) -> None:
        """Raises DbcError if `file` does not parse, lacks a message or has a bad one; ValueError for a bad `unit`."""
        if not 0 <= unit < UNITS:
            raise ValueError(f"unit={unit}: expected 0 to {UNITS - 1}, each drive of a bus its own")
        found = read_dbc(file)
        self._by_kind: dict[type[DriveMessage], Message] = {}
        self._by_id: dict[tuple[int, bool], tuple[Message, type[DriveMessage]]] = {}
        self._rules: dict[type[DriveMessage], list[Rule]] = {}      # of the fields, in their order
        for name, kind in MESSAGES.items():
            message = found.message_with(name, kind._fields)
            if message.length > 8:
                raise DbcError(f"{file}: message {name} has {message.length} bytes; classical CAN carries at most 8")
            key = (message.frame_id + unit, message.is_extended_frame)
            if key[0] > (EXTENDED_MASK if key[1] else STANDARD_MASK):
                raise DbcError(f"{file}: message {name}: unit {unit} would have the identifier {key[0]:#x}, beyond "
                               f"{29 if key[1] else 11} bits; give the message a lower one")
            if key in self._by_id:
                raise DbcError(f"{file}: message {name} has the identifier of {self._by_id[key][0].name}, "
                               f"{message.frame_id:#x}; give each its own")
            self._by_kind[kind], self._by_id[key] = message, (message, kind)
            self._rules[kind] = [_rule_of(message.get_signal_by_name(field)) for field in kind._fields]
        self._unit = unit

    def can_id(self, kind: type[DriveMessage]) -> int:
        return self._by_kind[kind].frame_id + self._unit

    def identifiers(self) -> list[tuple[int, bool]]:
        """Return (identifier, whether it is extended) of each message."""
        return list(self._by_id)

    def range_of(self, kind: type[DriveMessage], signal: str) -> tuple[float, float]:
        """Return the least and largest value of the signal that the DBC file allows."""
        found = self._by_kind[kind].get_signal_by_name(signal)
        return (float("-inf") if found.minimum is None else float(found.minimum),
                float("inf") if found.maximum is None else float(found.maximum))

    def pack(self, message: DriveMessage) -> bytes:
        """Return the struct for a `can` port; ValueError for a value out of its range."""
        layout = self._by_kind[type(message)]
        for rule, value in zip(self._rules[type(message)], message, strict=True):
            if not rule.admits(value):
                raise ValueError(f"{message}: {rule.broken_by(value)}")
        try:
            data = layout.encode(message._asdict(), strict=False)
        except (cantools_error(), ValueError, OverflowError) as error:
            raise ValueError(f"{message}: {error}") from None
        return pack(CanFrame(layout.frame_id + self._unit, data, layout.is_extended_frame))

    def kind_of(self, frame: CanFrame) -> type[DriveMessage] | None:
        """Return the message type of the frame's identifier; None if it is none of this drive's."""
        found = self._by_id.get((frame.can_id, frame.extended))
        return None if found is None or frame.error else found[1]

    def unpack(self, frame: CanFrame) -> DriveMessage | None:
        """Return the message in a frame; None for another device's. Raises FrameRefused, and nothing else."""
        found = self._by_id.get((frame.can_id, frame.extended))
        if found is None or frame.error:
            return None
        message, kind = found
        if frame.remote:
            raise FrameRefused(f"{message.name}: a remote frame")
        if frame.fd or len(frame.data) != message.length:
            raise FrameRefused(f"{message.name}: {len(frame.data)} bytes{' of CAN FD' if frame.fd else ''}, "
                               f"expected {message.length}")
        try:
            values: dict[str, Any] = message.decode_simple(frame.data, decode_choices=False)
        except (cantools_error(), ValueError, LookupError) as error:
            raise FrameRefused(f"{message.name}: {error}") from None
        drive_message = kind(**values)
        for rule, value in zip(self._rules[kind], drive_message, strict=True):
            if not rule.admits(value):
                raise FrameRefused(f"{message.name}: {rule.broken_by(value)}")
        return drive_message


def _rule_of(signal: Any) -> Rule:
    low, high = signal.minimum, signal.maximum
    return Rule(signal.name, -float_info.max if low is None else float(low),
                float_info.max if high is None else float(high), WORDS.get(signal.name))
