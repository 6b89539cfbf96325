"""A transparent radio modem, as an XBee in its default mode: what comes in over the serial line goes out on the radio.

    serial bytes --> packet being filled --full, or silence of `idle_bytes` byte times--> radio frame
    radio frame  --> serial line, at once

A modem is a node of its own with two ports; what happens to its frames on the way (loss, collisions, delay) is the
radio medium's. Frames that wait for the channel wait in that medium's queue (`mac = "csma"`, `queue_frames`), bytes
that wait for the serial line in that medium's `buffer_bytes`. It does not look into the bytes: a MAVLink frame may be
cut in two, and half of it be lost.

Silence is seen between the chunks of the serial line, so these have at most `idle_bytes` bytes (`chunk_bytes` of the
medium): then bytes without a gap keep the silence from ending, and it begins with the end of the last byte, exactly. A
full packet leaves late by less than a chunk.

Source: Digi, XBee/XBee-PRO RF Modules - 802.15.4, product manual 90000982 (2009): parameter RO, 3 character times by
default, and at most 100 bytes in a packet.
Not modelled: acknowledgements and retries of unicast (it broadcasts), command mode, flow control, sleeping.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Any, Final

from simpy.events import Event

from firmware_sim.board import Board
from firmware_sim.scenario_view import ScenarioView

SECOND_NS: Final = 1_000_000_000
PACKET_BYTES: Final = 100
IDLE_BYTES: Final = 3


class RadioModem:
    def __init__(self, board: Board, *, serial: str, radio: str, baud_bps: int, bits_per_byte: int = 10,
                 packet_bytes: int = PACKET_BYTES, idle_bytes: int = IDLE_BYTES) -> None:
        if baud_bps < 1 or bits_per_byte < 1:
            raise ValueError(f"baud_bps={baud_bps}, bits_per_byte={bits_per_byte}: expected at least 1")
        if packet_bytes < 1:
            raise ValueError(f"packet_bytes={packet_bytes}: expected at least 1")
        if idle_bytes < 0:
            raise ValueError(f"idle_bytes={idle_bytes}: expected 0 (send at once) or more")
        self._node = board.node
        self._serial, self._radio = board.node.ports[serial], board.node.ports[radio]
        self._serial.on_receive, self._radio.on_receive = self._from_serial, self._from_radio
        self._packet_bytes = packet_bytes
        self._idle_ns = -(-idle_bytes * bits_per_byte * SECOND_NS // baud_bps)
        self._packet = bytearray()
        self._chunks = 0                # that came in
        for counter in ("packets sent", "packets received"):
            self._node.count(counter, 0)

    def run(self) -> Generator[Event, Any, None]:
        """It only reacts."""
        yield from ()

    def _from_serial(self, data: bytes) -> None:
        self._packet += data
        while len(self._packet) >= self._packet_bytes:
            self._send(self._packet_bytes)
        self._chunks += 1
        if self._packet and not self._idle_ns:
            self._send(len(self._packet))
        elif self._packet:
            chunk = self._chunks
            self._node.call_in(self._idle_ns, lambda _: self._idle(chunk))

    def _idle(self, chunk: int) -> None:
        if chunk == self._chunks and self._packet:
            self._send(len(self._packet))

    def _send(self, size: int) -> None:
        self._radio.send(bytes(self._packet[:size]))
        del self._packet[:size]
        self._node.count("packets sent")

    def _from_radio(self, data: bytes) -> None:
        self._node.count("packets received")
        self._serial.send(data)

    @staticmethod
    def check(scenario: ScenarioView) -> Iterator[str]:
        """Ports that are not there or of another kind, packets that the radio does not carry, another baud rate."""
        for name, agent in scenario.agents.items():
            if agent.program != f"{RadioModem.__module__}:{RadioModem.__name__}":
                continue
            settings = {medium: scenario.media[medium].settings for medium in agent.media}
            serial = {port: format for port, each in settings.items() if (format := each.serial_format()) is not None}
            radios = {port: radio for port, each in settings.items() if (radio := each.radio()) is not None}
            for key, there, expected in (("serial", serial, "serial_line that it is on"),
                                         ("radio", radios, "broadcast_radio that it is on")):
                port = agent.parameters[key]
                if port not in there:
                    yield (f"agents.{name}.parameters.{key}={port}: expected a {expected}; there are "
                           f"{', '.join(there) or 'none'}")
                elif key == "serial":
                    clock, chunk = serial[port]
                    idle_bytes = agent.parameters.get("idle_bytes", IDLE_BYTES)
                    if idle_bytes and not 1 <= chunk <= idle_bytes:
                        yield (f"media.{port}.chunk_bytes={chunk}: expected 1 to {idle_bytes}, or {name} takes a chunk "
                               f"that is under way for {idle_bytes} byte times of silence")
                    own = agent.parameters["baud_bps"], agent.parameters.get("bits_per_byte", 10)
                    if own != (clock.baud_bps, clock.bits_per_byte):
                        yield (f"agents.{name}.parameters: {own[0]} bit/s and {own[1]} bits a byte, but {port} has "
                               f"{clock.baud_bps} and {clock.bits_per_byte}; make them equal")
                else:
                    most = radios[port].max_payload_bytes
                    size = agent.parameters.get("packet_bytes", PACKET_BYTES)
                    if most is not None and size > most:
                        yield (f"agents.{name}.parameters: packets of {size} bytes, but {port} carries {most}; set "
                               f"packet_bytes")
