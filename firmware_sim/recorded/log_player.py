"""Plays recorded frames on a port, each at its recorded time plus an offset, on the local clock, once or in a loop.

    file --frames chosen by the settings--> (time, bytes) in order of time --at time + offset--> port

A log that counts time since 1970 is played `from_first`: its first chosen frame is at `offset`, and the others follow
at their distances. With `loop_every_ns` the frames are played again each time this period has passed.

What arrives at the port is not answered. The medium carries the frames as it does those of any program, so a busy
medium delays them, and a frame that it does not take has a fate of its own.

Counters: `frames played`.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final

from simpy.events import Event

from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView

LARGEST_BYTES: Final = 256 << 20            # of a file: its frames are held in memory
PLAYED: Final = "frames played"


@dataclass(frozen=True)
class PlayerSettings:
    """`port` is the medium to play on, by default the only one. Times are those of the log, in ns."""

    file: Path
    port: str = ""
    offset_ns: int = 0                      # added to the recorded times
    from_first: bool = False                # recorded times count from the first chosen frame
    loop_every_ns: int = 0                  # 0: once

    def __post_init__(self) -> None:
        if self.loop_every_ns < 0:
            raise ValueError(f"loop_every_ns={self.loop_every_ns}: expected 0 (play once) or more")

    def chosen(self) -> Iterator[tuple[int, bytes]]:
        """Yield (recorded time in ns, bytes for the port) of each frame to play.

        Raises ValueError for a file that is no such log, OSError.
        """
        raise NotImplementedError

    def are_can_frames(self) -> bool:
        """Return whether the frames are for a port on a CAN bus; raises as `chosen`."""
        return False

    def frames(self) -> list[tuple[int, bytes]]:
        """Return (time to play, bytes) in order of time. Raises ValueError, OSError."""
        size = self.file.stat().st_size
        if size > LARGEST_BYTES:
            raise ValueError(f"{self.file}: {size} bytes, at most {LARGEST_BYTES}: cut it into parts")
        found = sorted(self.chosen(), key=lambda frame: frame[0])
        if not found:
            raise ValueError(f"{self.file}: holds no frame to play: expected at least one that the other parameters "
                             "choose")
        shift_ns = self.offset_ns - (found[0][0] if self.from_first else 0)
        if found[0][0] + shift_ns < 0:
            raise ValueError(f"the first frame would be played at {(found[0][0] + shift_ns) / 1e9:.9g} s, before the "
                             "start: raise offset_ns")
        span_ns = found[-1][0] - found[0][0]
        if self.loop_every_ns and self.loop_every_ns <= span_ns:
            raise ValueError(f"loop_every_ns={self.loop_every_ns}: expected more than the {span_ns} ns from the first "
                             "frame to the last")
        return [(time_ns + shift_ns, data) for time_ns, data in found]


class LogPlayer:
    """Base class of the programs; a member has the `Settings` of its format."""

    Settings: ClassVar[type[PlayerSettings]]

    def __init__(self, board: Board, settings: PlayerSettings) -> None:
        self._board, self._settings = board, settings
        self._port = board.port(settings.port or board.ports[0], listen_only=True)
        self._frames = settings.frames()
        board.count(PLAYED, 0)

    @classmethod
    def check(cls, scenario: ScenarioView, own: Own[PlayerSettings]) -> Iterator[str]:
        """Yield a problem for each port that is missing, file that cannot be played, and log outside of the run."""
        for name, agent in own.items():
            settings, place = agent.settings, f"agents.{name}.parameters"
            if (not settings.port and len(agent.media) != 1) or (settings.port and settings.port not in agent.media):
                yield (f"{place}.port={settings.port}: expected one of the media that {name} is on: "
                       f"{', '.join(agent.media) or 'there is none'}")
                continue
            port = settings.port or agent.media[0]
            is_bus = scenario.media[port].settings.carries_can_frames
            try:
                first_ns = settings.frames()[0][0]
                are_can = settings.are_can_frames()
            except OSError as error:
                yield f"{place}.file={settings.file}: {error.strerror or error}; name a log that can be read"
            except ValueError as error:
                yield f"{place}: {error}"
            else:
                if are_can != is_bus:
                    yield (f"{place}.port={port}: {settings.file.name} holds {'' if are_can else 'no '}CAN frames, and "
                           f"{port} is {'a' if is_bus else 'no'} CAN bus; name a port that fits, or another log")
                if first_ns >= scenario.length_ns:
                    yield (f"{place}: the first frame is at {first_ns / 1e9:.9g} s, after the run of "
                           f"{scenario.length_ns / 1e9:.9g} s: set from_first = true to play the log from its first "
                           "frame on, or lower offset_ns")

    def run(self) -> Generator[Event, Any, None]:
        board, send = self._board, self._port.send
        round_ns = 0
        while True:
            for time_ns, data in self._frames:
                yield from board.sleep_until(time_ns + round_ns)
                send(data)
                board.count(PLAYED)
            if not self._settings.loop_every_ns:
                return
            round_ns += self._settings.loop_every_ns


def one_of(key: str, wanted: Sequence[object], there: Mapping[object, object], file: Path) -> None:
    """Raise ValueError if a member of `wanted` is none of those in the file."""
    for each in wanted:
        if each not in there:
            raise ValueError(f"{key}={each}: not in {file}; there are {', '.join(map(str, there)) or 'none'}")
