"""The media that a scenario can name under `kind`."""

from __future__ import annotations

from typing import Final

from netem.media.broadcast_radio import BroadcastRadio
from netem.media.can.bus import CanBus
from netem.media.sensing.sensing import Sensing

MEDIA: Final = {
    "broadcast_radio": BroadcastRadio,
    "can": CanBus,
    "sensing": Sensing,
}
