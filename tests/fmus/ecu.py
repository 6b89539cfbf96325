"""Control units for tests: FMUs with a bus terminal, from tests/fmus/foreign/ecu3.c and the XML of FMI-LS-BUS 1.0.0."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path
from typing import Final

from fmus.platform_names import library_suffix, platform_fmi3
from tests.fmus.foreign_fmus import binary

KINDS: Final = ("countdown", "constant", "fixed", "tunable", "changing", "triggered")
MIME: Final = "application/org.fmi-standard.fmi-ls-bus.can; version=&quot;1.0.0&quot;"

MODEL: Final = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Ecu" instantiationToken="ecu">
  <CoSimulation modelIdentifier="ecu" canHandleVariableCommunicationStepSize="true" hasEventMode="true"/>
  <ModelVariables>
    <Binary name="Powertrain.Rx_Data" valueReference="0" causality="input" variability="discrete" clocks="2"
      maxSize="2048" mimeType="{mime}"><Start value=""/></Binary>
    <Binary name="Powertrain.Tx_Data" valueReference="1" causality="output" variability="discrete" clocks="3"
      initial="calculated" maxSize="4096" mimeType="{mime}"/>
    <Clock name="Powertrain.Rx_Clock" valueReference="2" causality="input" intervalVariability="triggered"/>
    <Clock name="Powertrain.Tx_Clock" valueReference="3" {clock}/>
    <Float64 name="period_ms" valueReference="4" causality="parameter" variability="fixed" start="0"/>
    <Float64 name="offset_ms" valueReference="5" causality="parameter" variability="fixed" start="0"/>
    <Float64 name="id" valueReference="6" causality="parameter" variability="fixed" start="256"/>
    <Float64 name="echo_ms" valueReference="7" causality="parameter" variability="fixed" start="-1"/>
    <Boolean name="retry" valueReference="8" causality="parameter" variability="fixed" start="false"/>
    <Boolean name="count_errors" valueReference="9" causality="parameter" variability="fixed" start="false"/>
    <Binary name="script" valueReference="10" causality="parameter" variability="fixed"><Start value=""/></Binary>
    <String name="log" valueReference="11" causality="parameter" variability="fixed"><Start value=""/></String>
    <Float64 name="tick_ms" valueReference="12" causality="parameter" variability="fixed" start="5"/>
    <Float64 name="tec" valueReference="13" causality="output" variability="discrete"/>
    <Float64 name="heard" valueReference="14" causality="output" variability="discrete"/>
    <Boolean name="org.fmi_standard.fmi_ls_bus.Can_BusNotifications" valueReference="15"
      causality="structuralParameter" variability="fixed" start="false"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="1"/></ModelStructure>
</fmiModelDescription>
"""

TERMINALS: Final = """<?xml version="1.0" encoding="UTF-8"?>
<fmiTerminalsAndIcons fmiVersion="3.0">
  <Terminals>
    <Terminal terminalKind="org.fmi-ls-bus.network-terminal" matchingRule="org.fmi-ls-bus.transceiver"
      name="Powertrain">
      <TerminalMemberVariable variableKind="signal" variableName="Powertrain.Rx_Clock" memberName="Rx_Clock"/>
      <TerminalMemberVariable variableKind="signal" variableName="Powertrain.Rx_Data" memberName="Rx_Data"/>
      <TerminalMemberVariable variableKind="signal" variableName="Powertrain.Tx_Clock" memberName="Tx_Clock"/>
      <TerminalMemberVariable variableKind="signal" variableName="Powertrain.Tx_Data" memberName="Tx_Data"/>
    </Terminal>
  </Terminals>
</fmiTerminalsAndIcons>
"""


def clock_xml(kind: str) -> str:
    interval = ' intervalDecimal="0.005"' if kind == "constant" else ""
    return (f'causality="{"output" if kind == "triggered" else "input"}" intervalVariability="{kind}"{interval}')


def ecu(path: Path, kind: str = "countdown", definitions: str = "", model: dict[str, str] | None = None,
        terminals: dict[str, str] | None = None) -> Path:
    """Write the FMU with a Tx_Clock of a kind; `model` and `terminals` replace text in its XML files."""
    texts = [MODEL.format(mime=MIME, clock=clock_xml(kind)), TERMINALS]
    for index, changes in enumerate((model or {}, terminals or {})):
        for old, new in changes.items():
            assert old in texts[index], old
            texts[index] = texts[index].replace(old, new)
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", texts[0])
        file.writestr("terminalsAndIcons/terminalsAndIcons.xml", texts[1])
        file.writestr(f"binaries/{platform_fmi3()}/ecu{library_suffix()}",
                      binary("ecu3.c", f"#define KIND {KINDS.index(kind)}\n{definitions}"))
    return path


def script(*values: tuple[int, bytes]) -> str:
    """Return the parameter `script` for values of Tx_Data, each `delay_us` after the one before it."""
    return b"".join(struct.pack("<II", delay_us, len(value)) + value for delay_us, value in values).hex()


def transmit(can_id: int, data: bytes = b"", extended: int = 0, remote: int = 0) -> bytes:
    return struct.pack("<IIIBBH", 0x10, 16 + len(data), can_id, extended, remote, len(data)) + data


def status(state: int) -> bytes:
    return struct.pack("<IIB", 0x41, 9, state)


def configure_losses(behavior: int) -> bytes:
    return struct.pack("<IIBB", 0x40, 10, 4, behavior)


def heard(log: Path) -> list[tuple[int, bytes]]:
    """Return (time_ns, value of Rx_Data) that an FMU wrote to its `log`."""
    lines = log.read_text().splitlines() if log.exists() else []
    return [(int(time), bytes.fromhex(value)) for time, value in (line.split(" ") for line in lines)]
