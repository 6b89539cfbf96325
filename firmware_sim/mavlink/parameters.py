"""The parameter protocol: list, read, write; every value is a REAL32.

PARAM_SET is answered by PARAM_VALUE with the value in force afterwards, which shows whether it was set; the reason of a
refusal is sent as a text. The list is sent one by one as the budget allows; a new request for it starts it again, since
the client has lost some. Source: mavlink.io, parameter protocol.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import isfinite

from firmware_sim.autopilot.vehicle import Parameters, Severity
from firmware_sim.mavlink.dialect import Message, message
from firmware_sim.mavlink.enums import PARAM_TYPE_REAL32
from firmware_sim.mavlink.link import Received


@dataclass
class ParameterService:
    parameters: Parameters
    notice: Callable[[Severity, str], None]
    event: Callable[[str, str], None] = lambda kind, detail: None
    _names: tuple[str, ...] = field(init=False)
    _listing: Iterator[str] | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self._names = tuple(self.parameters.infos)

    def handle(self, received: Received, now_ns: int) -> list[Message]:
        asked = received.message
        if asked.name == "PARAM_REQUEST_LIST":
            self._listing = iter(self._names)
            return []
        if asked.name == "PARAM_REQUEST_READ" and asked["param_index"] >= 0:
            index = asked["param_index"]
            return [self._value(self._names[index])] if index < len(self._names) else []
        name = asked["param_id"].decode("ascii", "replace")
        if name not in self.parameters.infos:
            self.notice(Severity.WARNING, f"no parameter {name}")
            return []
        if asked.name == "PARAM_SET":
            self._set(name, asked)
        return [self._value(name)]

    def next_of_list(self) -> Message | None:
        """Return the next parameter of a list that is being sent; None: no list is being sent."""
        if self._listing is None:
            return None
        name = next(self._listing, None)
        if name is None:
            self._listing = None
            return None
        return self._value(name)

    def _set(self, name: str, asked: Message) -> None:
        value = asked["param_value"]
        if asked["param_type"] != PARAM_TYPE_REAL32:
            why = f"{name}: type {asked['param_type']}, not REAL32"
        elif not isfinite(value):
            why = f"{name}={value}: is no number"
        else:
            why = self.parameters.set(name, value)
        if why:
            self.notice(Severity.WARNING, f"not set: {why}")
        self.event("parameter", f"{name} = {value!r}: {why or 'set'}")

    def _value(self, name: str) -> Message:
        return message("PARAM_VALUE", param_id=name.encode(), param_value=self.parameters.get(name),
                       param_type=PARAM_TYPE_REAL32, param_count=len(self._names), param_index=self._names.index(name))
