"""Finds the messages that a DBC file declares for one bus: those that a node of the bus sends at a known cycle time.

    BO_ sender            the node of that name in any case, or the one to which `dbc_nodes` maps it
    GenMsgCycleTime       the period
    CANFD_BRS             bit rate switch of CAN FD; on by default

Other messages are passed over with the reason: no cycle time, a sender that is not on the bus, a length that CAN does
not have, an identifier that two messages have, text that is not DBC. Signals are not read.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from netem.media.can.messages import CanMessage

if TYPE_CHECKING:
    from netem.media.can.dbc_file import DbcFile, Message

NS_PER_MS = 1_000_000


class Declared(NamedTuple):
    messages: dict[str, CanMessage]
    passed_over: dict[str, str]         # name of a message -> the reason


def declared_by(found: DbcFile, nodes: Sequence[str], dbc_nodes: Mapping[str, str]) -> Declared:
    """Return the messages that `nodes` send; `dbc_nodes` maps the file's names of control units to nodes."""
    by_name = {node.lower(): node for node in nodes}
    senders = {unit: by_name[unit.lower()] for message in found.database.messages for unit in message.senders
               if unit.lower() in by_name} | dict(dbc_nodes)
    declared = Declared({}, dict(found.left_out))
    twice = Counter((message.frame_id, message.is_extended_frame) for message in found.database.messages)
    for message in found.database.messages:
        try:
            if twice[message.frame_id, message.is_extended_frame] > 1:
                raise ValueError(f"identifier {message.frame_id:#x} stands there twice")
            declared.messages[message.name] = _as_declared(message, senders)
        except ValueError as error:
            declared.passed_over[message.name] = str(error)
    return declared


def _as_declared(message: Message, senders: Mapping[str, str]) -> CanMessage:
    """Return the message as declared; raises ValueError with the reason if it has to be passed over."""
    sender = next((senders[unit] for unit in message.senders if unit in senders), None)
    if sender is None:
        raise ValueError(f"sent by {', '.join(message.senders) or 'no control unit'}, not on this bus")
    if not message.cycle_time:
        raise ValueError("no cycle time")
    switch = message.dbc.attributes.get("CANFD_BRS") if message.dbc is not None else None
    return CanMessage(message.frame_id, message.cycle_time * NS_PER_MS, sender, message.length,
                      extended=message.is_extended_frame, fd=bool(message.is_fd),
                      bit_rate_switch=switch is None or str(switch.value) in ("1", "True"))
