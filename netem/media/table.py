"""The media that a scenario can name under `kind`."""

from __future__ import annotations

from typing import Final

from netem.media.broadcast_radio import BroadcastRadio
from netem.media.can.bus import CanBus
from netem.media.sensing.sensing import Sensing
from netem.media.serial_line.serial_line import SerialLine

MEDIA: Final = {
    "broadcast_radio": BroadcastRadio,
    "can": CanBus,
    "sensing": Sensing,
    "serial_line": SerialLine,
}
