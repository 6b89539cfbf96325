"""The media that a scenario can name under `kind`."""

from __future__ import annotations

from typing import Final

from netem.media.broadcast_radio import BroadcastRadio

MEDIA: Final = {
    "broadcast_radio": BroadcastRadio,
}
