"""A transparent radio modem, as an XBee in its default mode: it forwards bytes between a serial line and a radio.

    serial bytes --> packet being filled --full, or silence of `idle_bytes` byte times--> radio frame
    radio frame  --> serial line, at once

A modem is a node of its own with two ports; the radio medium models loss, collisions and delay of its frames. Frames
that wait for the channel wait in that medium's queue (`mac = "csma"`, `queue_frames`), bytes that wait for the serial
line in that medium's `buffer_bytes`. The modem does not interpret the bytes: it may cut a MAVLink frame in two, and the
radio may lose one half.

Either the serial line measures silence, as a UART with DMA does, or the modem. The line does with its `idle_bytes`, and
with `chunk_bytes` as large as a packet: what it delivers is a packet, and the modem has `idle_bytes` 0. The modem
measures it from the end of a chunk of a line without `idle_bytes`. Such chunks have at most the modem's `idle_bytes`
bytes, so bytes without a gap never count as silence, and silence begins exactly at the end of the last byte; but a
chunk that begins within that time and ends after it is late for the packet. A full packet is sent late by less than a
chunk.

Source: Digi, XBee/XBee-PRO RF Modules - 802.15.4, product manual 90000982 (2009): parameter RO, 3 character times by
default, and at most 100 bytes in a packet.
Not modelled: acknowledgements and retries of unicast (it broadcasts), command mode, flow control, sleeping.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from mypy_extensions import mypyc_attr

from firmware_sim.board import Board
from firmware_sim.radio_modem_settings import ModemSettings
from firmware_sim.scenario_view import Own, ScenarioView


@mypyc_attr(allow_interpreted_subclasses=True)
class RadioModem:
    Settings: ClassVar = ModemSettings

    def __init__(self, board: Board, settings: ModemSettings) -> None:
        self._board, self._settings = board, settings
        self._serial = board.port(settings.serial, self._from_serial)
        self._radio = board.port(settings.radio, self._from_radio)
        self._packet = bytearray()
        self._chunks = 0                # number of chunks received from the serial line
        for counter in ("packets sent", "packets received"):
            board.count(counter, 0)

    def _from_serial(self, data: bytes) -> None:
        self._packet += data
        while len(self._packet) >= self._settings.packet_bytes:
            self._send(self._settings.packet_bytes)
        self._chunks += 1
        if self._packet and not self._settings.idle_ns:
            self._send(len(self._packet))
        elif self._packet:
            chunk = self._chunks
            self._board.after(self._settings.idle_ns, lambda: self._idle(chunk))

    def _idle(self, chunk: int) -> None:
        if chunk == self._chunks and self._packet:
            self._send(len(self._packet))

    def _send(self, size: int) -> None:
        self._radio.send(bytes(self._packet[:size]))
        del self._packet[:size]
        self._board.count("packets sent")

    def _from_radio(self, data: bytes) -> None:
        self._board.count("packets received")
        self._serial.send(data)

    @staticmethod
    def check(scenario: ScenarioView, own: Own[ModemSettings]) -> Iterator[str]:
        """Yield a problem for each port missing or of a wrong kind, too large packets, and a different baud rate."""
        for name, modem in own.items():
            settings = modem.settings
            media = {medium: scenario.media[medium].settings for medium in modem.media}
            serial = {port: format for port, each in media.items() if (format := each.serial_format()) is not None}
            radios = {port: radio for port, each in media.items() if (radio := each.radio()) is not None}
            for key, port, there, expected in (("serial", settings.serial, serial, "serial_line that it is on"),
                                               ("radio", settings.radio, radios, "broadcast_radio that it is on")):
                if port not in there:
                    yield (f"agents.{name}.parameters.{key}={port}: expected a {expected}; there are "
                           f"{', '.join(there) or 'none'}")
            if settings.serial in serial:
                clock, chunk, idle = serial[settings.serial]
                if idle and (settings.idle_bytes or chunk != settings.packet_bytes):
                    yield (f"media.{settings.serial}: delivers packets, after idle_bytes={idle} of silence: expected "
                           f"chunk_bytes = {settings.packet_bytes} there, as packet_bytes here, and idle_bytes = 0 in "
                           f"agents.{name}.parameters; found {chunk} and {settings.idle_bytes}")
                elif settings.idle_bytes and not 1 <= chunk <= settings.idle_bytes:
                    yield (f"media.{settings.serial}.chunk_bytes={chunk}: expected 1 to {settings.idle_bytes}, or "
                           f"{name} takes a chunk that is under way for {settings.idle_bytes} byte times of silence")
                if (settings.baud_bps, settings.bits_per_byte) != (clock.baud_bps, clock.bits_per_byte):
                    yield (f"agents.{name}.parameters: {settings.baud_bps} bit/s and {settings.bits_per_byte} bits a "
                           f"byte, but {settings.serial} has {clock.baud_bps} and {clock.bits_per_byte}; make them "
                           f"equal")
            if settings.radio in radios:
                most = radios[settings.radio].max_payload_bytes
                if most is not None and settings.packet_bytes > most:
                    yield (f"agents.{name}.parameters: packets of {settings.packet_bytes} bytes, but {settings.radio} "
                           f"carries {most}; set packet_bytes")
