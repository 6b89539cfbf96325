"""Decides which frames a bus carries.

A frame has to be well-formed, CAN FD needs a data bit rate, and with `messages_only` the scenario has to declare it.
"""

from __future__ import annotations

from netem.media.can.encoded_frame import EncodedFrame, encode_frame
from netem.media.can.frame import MalformedFrame
from netem.media.can.settings import CanSettings


class Admission:
    def __init__(self, settings: CanSettings) -> None:
        self._fd = settings.data_bit_rate_bps is not None
        self._messages = {message.rank: message for message in settings.messages.values()}
        self._messages_only = settings.messages_only

    def admit(self, sender: str, data: bytes) -> EncodedFrame:
        """Return the encoded frame; raises `MalformedFrame` with the reason if the bus does not carry it."""
        encoded = encode_frame(data)
        if encoded.fd and not self._fd:
            raise MalformedFrame("CAN FD on a bus without data_bit_rate_bps")
        if self._messages_only:
            message = self._messages.get(encoded.rank)
            if message is None or message.sender != sender:
                raise MalformedFrame("not a declared message of this node")
            switched = encoded.fd and encoded.data_bits > 0
            if (message.fd, message.fd and message.bit_rate_switch, message.length_bytes) != (
                    encoded.fd, switched, encoded.data[4]):
                raise MalformedFrame("not of the declared length and format")
        return encoded
