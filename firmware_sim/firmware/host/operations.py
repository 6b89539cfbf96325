"""The operations and questions of a firmware on the host, numbered as in marconet_host.h, and what carries them out.

Plain numbers: to compare members of an enumeration takes longer than most calls.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final, Protocol

# Operation of marconet_host.h
SEND: Final = 0
SET_TIMER: Final = 1
SET_DELAY: Final = 2
CANCEL: Final = 3
PROMISE: Final = 4
ACTUATE: Final = 5
COUNT: Final = 6
EVENT: Final = 7
MISTAKE: Final = 8

# Question of marconet_host.h
HAND_OVER: Final = 0
ADJUST_CLOCK: Final = 1
SENSE: Final = 2
RANDOM: Final = 3

Call = tuple[int, int, int, int, float]         # operation, id, integer, place, real: see `Call` of marconet_host.h


class Carrier(Protocol):
    """Carries out the calls of one firmware: `BoardCalls`.

    Two of them are also carried out without `carry_out`: SEND of a frame that is not too long is `send[id](frame)`,
    ACTUATE is `written[id] = real` and `write[id]((real,))`.
    """

    written: list[float]                        # the value that each actuator was given last

    @property
    def send(self) -> Sequence[Callable[[bytes], None]]: ...            # one for each port

    @property
    def write(self) -> Sequence[Callable[[tuple[float]], object]]: ...  # one for each actuator

    @property
    def read(self) -> Sequence[Callable[[], float | None]]: ...         # one for each sensor; None: BOARD_NO_VALUE

    def carry_out(self, calls: Iterable[Call]) -> None:
        """Carry out the calls, in order."""

    def answer(self, question: int, number: int, integer: int, real: float) -> float | None:
        """Return the answer to ADJUST_CLOCK or RANDOM; None for BOARD_NO_VALUE."""
