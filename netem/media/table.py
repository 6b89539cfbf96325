"""The media that a scenario can name under `kind`."""

from __future__ import annotations

from typing import Final

from netem.core.kinds import Kinds

MEDIA: Final = Kinds({
    "broadcast_radio": "netem.media.broadcast_radio:BroadcastRadio",
    "can": "netem.media.can.bus:CanBus",
    "packet_network": "netem.media.packet_network.packet_network:PacketNetwork",
    "sensing": "netem.media.sensing.sensing:Sensing",
    "serial_line": "netem.media.serial_line.serial_line:SerialLine",
})
