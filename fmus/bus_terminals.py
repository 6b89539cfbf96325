"""Reads the bus terminals of an FMU from terminalsAndIcons/terminalsAndIcons.xml, for FMI-LS-BUS, low cut.

    terminalKind org.fmi-ls-bus.network-terminal, matchingRule org.fmi-ls-bus.transceiver
    Tx_Data  binary output, clocked by Tx_Clock          Tx_Clock  time-based input or triggered output
    Rx_Data  binary input, clocked by Rx_Clock           Rx_Clock  triggered input
    mimeType of both data variables: application/org.fmi-standard.fmi-ls-bus.can; version="1.0.0"

Terminals of other kinds are passed over, and so are files that an FMU of no bus has wrongly: only a program that needs
the bus asks for the problem. Source: FMI-LS-BUS 1.0.0, chapter 4, "Terminal Definitions" and "Variables".

Not read: the nested terminal `Configuration`, signals of the high cut, icons.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from fmus.archive import one_line, shown
from fmus.description import BusTerminal, Variable

FILES: Final = ("terminalsAndIcons/terminalsAndIcons.xml", "icons/terminalsAndIcons.xml")
KIND: Final = "org.fmi-ls-bus.network-terminal"
MATCHING_RULE: Final = "org.fmi-ls-bus.transceiver"
MEMBERS: Final = ("Tx_Data", "Tx_Clock", "Rx_Data", "Rx_Clock")
CAN_MIME: Final = re.compile(r'application/org\.fmi-standard\.fmi-ls-bus\.can\s*;\s*version="1\.[^"]*"')
TIME_BASED: Final = ("constant", "fixed", "tunable", "changing", "countdown")


def bus_terminals(folder: Path, variables: Mapping[str, Variable]) -> tuple[tuple[BusTerminal, ...], str]:
    """Return the bus terminals of the FMU unpacked in `folder`, and why one that is there cannot be used, or ""."""
    file = next((name for name in FILES if (folder / name).is_file()), None)
    if file is None:
        return (), ""
    try:
        text = (folder / file).read_bytes()
        if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
            raise ValueError("declares a document type, which it does not need")
        elements = ElementTree.fromstring(text).iterfind("Terminals/Terminal")
        found = [_terminal(element, variables) for element in elements if element.get("terminalKind") == KIND]
        names = [terminal.name for terminal in found]
        if len(set(names)) < len(names):
            raise ValueError(f"two bus terminals are called {shown(max(names, key=names.count))}")
    except (ValueError, ElementTree.ParseError, OSError) as error:
        return (), f"{file}: {one_line(error)}"
    return tuple(found), ""


def _terminal(element: ElementTree.Element, variables: Mapping[str, Variable]) -> BusTerminal:
    name = element.get("name", "")
    place = f"terminal {shown(name)}"
    if element.get("matchingRule") != MATCHING_RULE:
        raise ValueError(f"{place}: matchingRule={shown(element.get('matchingRule', ''))}: expected {MATCHING_RULE}")
    members = {member.get("memberName", ""): member.get("variableName", "")
               for member in element.iterfind("TerminalMemberVariable")}
    for member in MEMBERS:
        if member not in members:
            raise ValueError(f"{place}: has no member {member}; a bus terminal has {', '.join(MEMBERS)}")
        if members[member] not in variables:
            raise ValueError(f"{place}: {member}: the FMU has no variable {shown(members[member])}")
    for way, causality in (("Tx", "output"), ("Rx", "input")):
        data, clock = variables[members[f"{way}_Data"]], variables[members[f"{way}_Clock"]]
        if data.type != "Binary" or data.causality != causality or data.shape not in ((), (1,)):
            raise ValueError(f"{place}: {way}_Data is {data.causality} of type {data.type}: expected one binary "
                             f"{causality}")
        if not CAN_MIME.fullmatch(data.mime_type.strip()):
            raise ValueError(f"{place}: {way}_Data has mimeType={shown(data.mime_type)!r}: this bus is CAN, "
                             'application/org.fmi-standard.fmi-ls-bus.can; version="1.0.0"')
        if clock.reference not in data.clocks:
            raise ValueError(f"{place}: {way}_Data is not clocked by {way}_Clock; name its reference in `clocks`")
        _check_clock(place, way, clock)
    return BusTerminal(name, *(members[member] for member in MEMBERS))


def _check_clock(place: str, way: str, clock: Variable) -> None:
    kind = clock.clock.variability if clock.clock is not None else "no clock"
    allowed = [("triggered", "input")] if way == "Rx" else [*((each, "input") for each in TIME_BASED),
                                                           ("triggered", "output")]
    if (kind, clock.causality) not in allowed:
        raise ValueError(f"{place}: {way}_Clock is {clock.causality}, {kind}: expected "
                         + ("a triggered input" if way == "Rx" else "a time-based input "
                            f"({', '.join(TIME_BASED)}) or a triggered output"))
