"""Plays a log of a CAN bus, in a format that python-can reads: candump, BLF, ASC, TRC, CSV.

    [agents.ecu]
    program = "firmware_sim.recorded.can_log:CanLogPlayer"
    parameters = { file = "drive.log", identifiers = [0x120, 0x121] }

Logs stamp a frame when it is complete, and the program hands it out at that time. On the bus it is therefore later than
it was by its own length; a capture (capture.py) has the first bit and is played at equal instants. Error frames are not
played: errors are the bus's own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from firmware_sim.recorded.log_player import LogPlayer, PlayerSettings, one_of
from netem.media.can.can_log_reader import read_can_log
from netem.media.can.frame import EXTENDED_MASK, unpack


@dataclass(frozen=True)
class CanLogSettings(PlayerSettings):
    """No `identifiers` or `channels`: all of the file. Identifiers of 11 and of 29 bits are named alike."""

    identifiers: tuple[int, ...] = ()
    channels: tuple[str, ...] = ()              # as the log names them: "can0", "0"

    def __post_init__(self) -> None:
        super().__post_init__()
        for identifier in self.identifiers:
            if not 0 <= identifier <= EXTENDED_MASK:
                raise ValueError(f"identifiers={identifier}: expected 0 to {EXTENDED_MASK:#x}")

    def chosen(self) -> Iterator[tuple[int, bytes]]:
        identifiers, channels = dict.fromkeys(self.identifiers), dict.fromkeys(self.channels)
        there: dict[object, object] = {}
        for time_ns, channel, data in read_can_log(self.file):
            there[channel] = None
            if data and (not channels or channel in channels) and (
                    not identifiers or unpack(data).can_id in identifiers):
                yield time_ns, data
        one_of("channels", self.channels, there, self.file)

    def are_can_frames(self) -> bool:
        return True


class CanLogPlayer(LogPlayer):
    Settings = CanLogSettings
