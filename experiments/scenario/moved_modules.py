"""Former names of modules, so that the error for a program that imports one can name the present module."""

from __future__ import annotations

from typing import Final

MOVED: Final = {
    "netem.agenda": "netem.core.agenda",
    "netem.alarm": "netem.node.environment",
    "netem.diagnosis": "netem.transport.diagnosis",
    "netem.fate": "netem.core.fate",
    "netem.fate_meaning": "netem.core.fate",
    "netem.frame": "netem.core.frame",
    "netem.kinds": "netem.core.kinds",
    "netem.link_selector": "netem.core.link_selector",
    "netem.links": "netem.media.links",
    "netem.lockstep.conductor": "netem.emulator.conductor",
    "netem.lockstep.credible": "netem.wire.credible",
    "netem.lockstep.errors": "netem.wire.errors",
    "netem.lockstep.hosts": "netem.transport.hosts",
    "netem.lockstep.messages": "netem.wire.messages",
    "netem.lockstep.program_errors": "netem.wire.program_errors",
    "netem.lockstep.watchdog": "netem.transport.watchdog",
    "netem.media.can.wire_length": "netem.media.can.encoded_frame",
    "netem.named": "netem.node.named",
    "netem.node_environment": "netem.node.environment",
    "netem.outside_guard": "netem.node.outside_guard",
    "netem.random_streams": "netem.core.random_streams",
    "netem.real_time.lateness": "netem.gateways.lateness",
    "netem.real_time.pace": "netem.gateways.pace",
    "netem.real_time.udp_gateway": "netem.gateways.udp",
    "netem.records.can_log": "netem.media.can.can_log",
    "netem.records.ledger_table": "netem.records.ledger_file",
    "netem.transit": "netem.core.transit",
    "netem.transport.errand": "netem.transport.start_message",
    "netem.transport.keys": "netem.wire.keys",
    "netem.turn": "netem.node.turn",
}


def where_it_is(module: str) -> str:
    """Return "; it is now NAME" for a module that has moved, "" for any other."""
    return f"; it is now {MOVED[module]}" if module in MOVED else ""
