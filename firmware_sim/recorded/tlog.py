"""Plays a MAVLink telemetry log (`.tlog`), such as a vehicle's stream: each MAVLink frame as one frame of the port.

    [agents.vehicle]
    program = "firmware_sim.recorded.tlog:TlogPlayer"
    parameters = { file = "flight.tlog", systems = [1], from_first = true }

Frames are played as they were, with their sequence numbers and signatures; a receiver that checks the timestamps of
signatures refuses old ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from firmware_sim.mavlink.tlog import read_tlog
from firmware_sim.recorded.log_player import LogPlayer, PlayerSettings, one_of


@dataclass(frozen=True)
class TlogSettings(PlayerSettings):
    """No `systems` or `components`: those of all."""

    systems: tuple[int, ...] = ()
    components: tuple[int, ...] = ()

    def chosen(self) -> Iterator[tuple[int, bytes]]:
        there: dict[object, object] = {}
        for logged in read_tlog(self.file):
            there[logged.system] = None
            if (not self.systems or logged.system in self.systems) and (
                    not self.components or logged.component in self.components):
                yield logged.time_ns, logged.data
        one_of("systems", self.systems, there, self.file)


class TlogPlayer(LogPlayer):
    Settings = TlogSettings
