"""Error counters of one controller and the state that follows from them (ISO 11898-1:2015, 12.1).

                    TEC > 127 or REC > 127                 TEC > 255
    error-active <--------------------------> error-passive ---------> bus-off --128 x 11 recessive bits--> error-active
                    both <= 127

    sender of an error frame       TEC + 8      sent without error      TEC - 1
    receiver of an error frame     REC + 1      received without error  REC - 1, but from above 127 down to 119

Not modelled: REC + 8 for a receiver that alone detects an error and for errors within error flags, as all nodes see the
same bits; the warning limit of 96.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

PASSIVE_ABOVE: Final = 127
BUS_OFF_ABOVE: Final = 255
BACK_FROM_PASSIVE: Final = 119          # the standard allows 119..127


class State(Enum):
    ERROR_ACTIVE = "error-active"
    ERROR_PASSIVE = "error-passive"
    BUS_OFF = "bus-off"


@dataclass(slots=True)
class FaultConfinement:
    transmit_errors: int = 0            # TEC
    receive_errors: int = 0             # REC
    state: State = State.ERROR_ACTIVE

    @property
    def passive(self) -> bool:
        return self.state is State.ERROR_PASSIVE

    @property
    def calm(self) -> bool:
        """True if both counters are 0, so that a frame without errors does not change them."""
        return not self.transmit_errors and not self.receive_errors

    def sent(self) -> None:
        if self.transmit_errors:
            self.transmit_errors -= 1
            self._renew()

    def received(self) -> None:
        if self.receive_errors > PASSIVE_ABOVE:
            self.receive_errors = BACK_FROM_PASSIVE
            self._renew()
        elif self.receive_errors:
            self.receive_errors -= 1

    def transmit_error(self) -> None:
        self.transmit_errors += 8
        self._renew()

    def receive_error(self) -> None:
        self.receive_errors += 1
        self._renew()

    def dominant_after_flag(self) -> None:
        """Count 8 dominant bits after an error flag, as a node that did not send."""
        self.receive_errors += 8
        self._renew()

    def forced_off(self) -> None:
        """Go bus-off, as a controller whose transmit error counter has passed its limit."""
        self.transmit_errors = BUS_OFF_ABOVE + 1
        self.state = State.BUS_OFF

    def recovered(self) -> None:
        """Return to error-active, after 128 runs of 11 recessive bits."""
        self.transmit_errors = self.receive_errors = 0
        self.state = State.ERROR_ACTIVE

    def _renew(self) -> None:
        assert self.state is not State.BUS_OFF, "a controller that is bus-off takes no part"
        if self.transmit_errors > BUS_OFF_ABOVE:
            self.state = State.BUS_OFF
        elif self.transmit_errors > PASSIVE_ABOVE or self.receive_errors > PASSIVE_ABOVE:
            self.state = State.ERROR_PASSIVE
        else:
            self.state = State.ERROR_ACTIVE
